//! Positions on the earth, and a flat coordinate system around one of them.
//!
//! A [`Plane`] converts each position to metres east and north of an origin: the length and the azimuth of the geodesic
//! from there, on the ellipsoid of WGS84. Within 10 km of the origin distances are true to a part in a million, also
//! over a pole and over the 180th meridian. The geodesics are geographiclib's.

use derive_more::{Add, AddAssign, Div, Mul, Sub};
use geographiclib_rs::{DirectGeodesic, Geodesic, InverseGeodesic};

/// A position on the earth, on the ellipsoid of WGS84.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Place {
    /// Degrees to the north, -90 to 90.
    pub latitude: f64,
    /// Degrees to the east, -180 to 180.
    pub longitude: f64,
}

impl Place {
    /// A position. `None` if these are no coordinates.
    pub fn new(latitude: f64, longitude: f64) -> Option<Self> {
        let is_one = (-90.0..=90.0).contains(&latitude) && (-180.0..=180.0).contains(&longitude);
        is_one.then_some(Self { latitude, longitude })
    }

    /// Metres from here to another position.
    pub fn distance_m(self, other: Self) -> f64 {
        Geodesic::wgs84().inverse(self.latitude, self.longitude, other.latitude, other.longitude)
    }
}

/// Metres on a [`Plane`], or the difference of two such positions.
#[derive(Add, AddAssign, Clone, Copy, Debug, Default, Div, Mul, PartialEq, Sub)]
pub struct Metres {
    /// To the east.
    pub east: f64,
    /// To the north.
    pub north: f64,
}

impl Metres {
    /// A metre in a direction, in degrees from north to the east.
    pub fn toward(degrees: f64) -> Self {
        let (east, north) = degrees.to_radians().sin_cos();
        Self { east, north }
    }

    /// How far that is.
    pub fn length(self) -> f64 {
        self.east.hypot(self.north)
    }

    /// The same length to the right of this direction.
    pub fn turned_right(self) -> Self {
        Self { east: self.north, north: -self.east }
    }
}

/// A flat field around an origin.
#[derive(Clone, Debug)]
pub struct Plane {
    earth: Geodesic,
    origin: Place,
}

impl Plane {
    /// The plane around this position.
    pub fn around(origin: Place) -> Self {
        Self { earth: Geodesic::wgs84(), origin }
    }

    /// The coordinates of a position.
    pub fn metres(&self, place: Place) -> Metres {
        let Place { latitude, longitude } = self.origin;
        let (length, azimuth, _, _): (f64, f64, f64, f64) =
            self.earth.inverse(latitude, longitude, place.latitude, place.longitude);
        Metres::toward(azimuth) * length
    }

    /// The position at these coordinates.
    pub fn place(&self, metres: Metres) -> Place {
        let azimuth = metres.east.atan2(metres.north).to_degrees();
        let (latitude, longitude) =
            self.earth.direct(self.origin.latitude, self.origin.longitude, azimuth, metres.length());
        Place { latitude, longitude }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_place_within_ten_kilometres_comes_back_anywhere_on_the_earth(
            latitude in -90.0..=90.0_f64, longitude in -180.0..=180.0_f64, east in -7000.0..7000.0_f64, north in -7000.0..7000.0_f64,
        ) {
            let plane = Plane::around(Place { latitude, longitude });
            let place = plane.place(Metres { east, north });
            prop_assert!(Place::new(place.latitude, place.longitude).is_some(), "{place:?}");
            let back = plane.metres(place);
            prop_assert!((back.east - east).abs() < 1e-6 && (back.north - north).abs() < 1e-6, "{back:?}");
        }

        #[test]
        fn distances_within_a_field_are_those_on_the_earth(
            latitude in -85.0..85.0_f64, longitude in -180.0..=180.0_f64, to in prop::array::uniform4(-1000.0..1000.0_f64),
        ) {
            let plane = Plane::around(Place { latitude, longitude });
            let [one, other] = [Metres { east: to[0], north: to[1] }, Metres { east: to[2], north: to[3] }];
            let on_earth = plane.place(one).distance_m(plane.place(other));
            prop_assert!((on_earth - (other - one).length()).abs() < 1e-4);
        }
    }

    #[test]
    fn east_is_to_the_right_of_north() {
        let right = Metres { east: 0.0, north: 1.0 }.turned_right();
        assert_eq!((right.east, right.north), (1.0, 0.0));
    }

    #[test]
    fn coordinates_beyond_the_earth_are_none() {
        for (latitude, longitude) in [(90.1, 0.0), (0.0, 180.1), (f64::NAN, 0.0), (0.0, f64::INFINITY)] {
            assert_eq!(Place::new(latitude, longitude), None);
        }
    }
}
