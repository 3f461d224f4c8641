//! Orthonormal directions of a model's columns, and least squares along them.
//!
//! The method is Gram and Schmidt's, and each column is made orthogonal twice: once loses digits where columns are
//! nearly dependent. A column that depends on those before it adds no direction, so the directions count the rank. At
//! the end each column is put together from the directions. If that fails, there is no basis: a wrong span would make
//! wrong sums of squares.

/// Less than this share of a column is rounding.
const ROUNDING: f64 = 1e-9;

/// The directions of some columns.
pub(super) struct Basis {
    /// Each is orthogonal to the others and has length 1.
    directions: Vec<Vec<f64>>,
    /// The components of each column along the directions that were there when it was added.
    components: Vec<Vec<f64>>,
}

/// A least-squares fit.
pub(super) struct Solution {
    /// The coefficient of each column.
    pub coefficients: Vec<f64>,
    /// The variance of each coefficient, for a residual variance of 1.
    pub variances: Vec<f64>,
}

impl Basis {
    /// The directions of these columns. `None` if they do not reproduce a column.
    pub fn of<C: AsRef<[f64]>>(columns: &[C]) -> Option<Self> {
        let mut basis = Self { directions: Vec::new(), components: Vec::new() };
        for column in columns.iter().map(AsRef::as_ref) {
            let (rest, mut components) = basis.taken_apart(column);
            let length = norm(&rest);
            if length > ROUNDING * norm(column) {
                basis.directions.push(rest.iter().map(|value| value / length).collect());
                components.push(length);
            }
            basis.components.push(components);
        }
        let is_spanned = |column: &C| norm(&basis.residual(column.as_ref())) <= 2.0 * ROUNDING * norm(column.as_ref());
        columns.iter().all(is_spanned).then_some(basis)
    }

    /// How many columns are independent.
    pub fn rank(&self) -> usize {
        self.directions.len()
    }

    /// What the directions leave of these values.
    pub fn residual(&self, values: &[f64]) -> Vec<f64> {
        self.taken_apart(values).0
    }

    /// The share of a row's own value in its fitted value, 0 to 1.
    pub fn leverage(&self, row: usize) -> f64 {
        self.directions.iter().map(|direction| direction[row] * direction[row]).sum()
    }

    /// The least-squares fit of these values. `None` if the columns depend on each other.
    pub fn solve(&self, values: &[f64]) -> Option<Solution> {
        let count = self.components.len();
        if self.rank() < count {
            return None;
        }
        let (_, along) = self.taken_apart(values);
        // The components are a triangle: column `j` reaches direction `j`.
        let solved = |right: &[f64]| {
            let mut solution = vec![0.0; count];
            for row in (0..count).rev() {
                let known: f64 = (row + 1..count).map(|column| self.components[column][row] * solution[column]).sum();
                solution[row] = (right[row] - known) / self.components[row][row];
            }
            solution
        };
        let mut variances = vec![0.0; count];
        for unit in 0..count {
            let right: Vec<f64> = (0..count).map(|row| f64::from(row == unit)).collect();
            variances.iter_mut().zip(solved(&right)).for_each(|(variance, part)| *variance += part * part);
        }
        Some(Solution { coefficients: solved(&along), variances })
    }

    /// What is left of these values, and their components along the directions.
    fn taken_apart(&self, values: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let (mut rest, mut components) = (values.to_vec(), vec![0.0; self.rank()]);
        for _ in 0..2 {
            for (direction, component) in self.directions.iter().zip(&mut components) {
                let along: f64 = direction.iter().zip(&rest).map(|(a, b)| a * b).sum();
                rest.iter_mut().zip(direction).for_each(|(value, part)| *value -= along * part);
                *component += along;
            }
        }
        (rest, components)
    }
}

fn norm(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum::<f64>().sqrt()
}
