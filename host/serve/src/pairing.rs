//! Pairing: the operator types or scans the terminal's code on a phone once, and its browser then presents a token.
//!
//! The caller passes the code and the tokens, made from the system's random source, and the time. Comparison takes
//! constant time, so its duration does not tell how much was right. After five wrong codes every code is refused for a
//! minute, also the right one and from any address, because an address is easily changed. The code has 40 bits. At this
//! rate an attacker guesses it with a chance of one in a hundred million a day.

use std::collections::VecDeque;
use std::time::{Duration, Instant};
use subtle::ConstantTimeEq;

/// Characters of a code. I, L, O and U are left out, because they are easily misread.
const ALPHABET: &[u8; 32] = b"0123456789ABCDEFGHJKMNPQRSTVWXYZ";

const CODE_LENGTH: usize = 8;

/// Wrong codes after which codes are refused for some time.
const TRIES: u32 = 5;

/// How long codes are then refused.
const LOCKED_FOR: Duration = Duration::from_secs(60);

/// Greatest number of paired phones. A further one replaces the oldest, which must pair again.
const PHONES: usize = 32;

/// The secret that a paired browser presents.
pub type Token = [u8; 32];

/// A pairing code.
#[derive(Clone)]
pub struct Code([u8; CODE_LENGTH]);

impl Code {
    /// The code of some random bytes.
    pub fn new(random: [u8; CODE_LENGTH]) -> Self {
        // There are 32 characters, so all are equally likely.
        Self(random.map(|byte| ALPHABET[usize::from(byte) % ALPHABET.len()]))
    }

    /// The code for an address.
    pub fn text(&self) -> String {
        self.0.iter().copied().map(char::from).collect()
    }

    /// The code for reading and typing: K7QM-2F9X.
    pub fn spelled(&self) -> String {
        let text = self.text();
        format!("{}-{}", &text[..CODE_LENGTH / 2], &text[CODE_LENGTH / 2..])
    }

    /// Whether the typed text is this code. It accepts upper and lower case, blanks, dashes, and characters that are
    /// easily confused.
    fn is(&self, typed: &str) -> bool {
        let mut characters =
            typed.bytes().filter(|byte| !matches!(byte, b' ' | b'-')).map(|byte| match byte.to_ascii_uppercase() {
                b'O' => b'0',
                b'I' | b'L' => b'1',
                other => other,
            });
        let mut read = [0; CODE_LENGTH];
        read.fill_with(|| characters.next().unwrap_or_default());
        bool::from(self.0.ct_eq(&read)) && characters.next().is_none()
    }
}

/// The result of a try.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Try {
    /// It was the code.
    Right,
    /// It was wrong. `left` more wrong codes are allowed; after 0 codes are refused for some time.
    Wrong {
        /// Tries that are left.
        left: u32,
    },
    /// Codes are refused for this time.
    Locked(Duration),
}

/// The paired phones, and the count of wrong codes.
pub struct Pairing {
    code: Code,
    wrong: u32,
    locked_until: Option<Instant>,
    /// Their numbers, which are never reused, and their tokens in the form of the cookie.
    paired: VecDeque<(u64, String)>,
    next: u64,
}

impl Pairing {
    /// No browser is paired yet.
    pub fn new(code: Code) -> Self {
        Self { code, wrong: 0, locked_until: None, paired: VecDeque::new(), next: 0 }
    }

    /// Checks a typed code. If it is right, the caller gives the browser a [`token`](Self::pair).
    pub fn try_code(&mut self, typed: &str, now: Instant) -> Try {
        if let Some(until) = self.locked_until {
            if now < until {
                return Try::Locked(until - now);
            }
            (self.locked_until, self.wrong) = (None, 0);
        }
        if self.code.is(typed) {
            self.wrong = 0;
            return Try::Right;
        }
        self.wrong += 1;
        if self.wrong == TRIES {
            self.locked_until = Some(now + LOCKED_FOR);
        }
        Try::Wrong { left: TRIES - self.wrong }
    }

    /// Pairs the browser with this token; returns the number of paired browsers.
    pub fn pair(&mut self, token: Token) -> usize {
        if self.paired.len() == PHONES {
            self.paired.pop_front();
        }
        self.paired.push_back((self.next, hex::encode(token)));
        self.next += 1;
        self.paired.len()
    }

    /// The number of the phone with this token, in 64 hexadecimal digits, if it is paired.
    pub fn phone(&self, shown: &str) -> Option<u64> {
        // All are compared to the end, so that the time reveals nothing.
        self.paired.iter().fold(None, |found, (number, token)| {
            if bool::from(token.as_bytes().ct_eq(shown.as_bytes())) { Some(*number) } else { found }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pairing() -> Pairing {
        Pairing::new(Code::new([19, 7 + 32, 22, 20 + 64, 2, 15, 9, 29]))
    }

    #[test]
    fn a_code_is_right_in_any_spelling() {
        let code = pairing().code;
        assert_eq!((code.text().as_str(), code.spelled().as_str()), ("K7PM2F9X", "K7PM-2F9X"));
        for typed in ["K7PM2F9X", "k7pm-2f9x", " K7PM 2F9X "] {
            assert_eq!(pairing().try_code(typed, Instant::now()), Try::Right, "{typed}");
        }
        let ambiguous = Code::new([0, 1, 1, 0, 0, 0, 0, 0]);
        assert!(ambiguous.is("oIl0-0000"));
    }

    #[test]
    fn a_code_is_wrong_by_any_character_more_or_less() {
        for typed in
            ["", "K", "K7PM2F9", "K7PM2F9XX", "K7PM2F9Y", "A7PM2F9X", "K7PM2F9X0", "\0\0\0\0\0\0\0\0", "Ķ7PM2F9X"]
        {
            assert_eq!(pairing().try_code(typed, Instant::now()), Try::Wrong { left: 4 }, "{typed:?}");
        }
    }

    #[test]
    fn after_five_wrong_codes_none_is_accepted_for_a_minute() {
        let (mut pairing, start) = (pairing(), Instant::now());
        for left in (0..5).rev() {
            assert_eq!(pairing.try_code("00000000", start), Try::Wrong { left });
        }
        for seconds in [0, 1, 59] {
            let now = start + Duration::from_secs(seconds);
            assert_eq!(pairing.try_code("K7PM2F9X", now), Try::Locked(Duration::from_secs(60 - seconds)));
        }
        let later = start + Duration::from_secs(60);
        assert_eq!(pairing.try_code("00000000", later), Try::Wrong { left: 4 });
        assert_eq!(pairing.try_code("K7PM2F9X", later), Try::Right);
    }

    #[test]
    fn a_right_code_forgives_the_wrong_ones_before_it() {
        let (mut pairing, now) = (pairing(), Instant::now());
        for _ in 0..3 {
            for _ in 0..4 {
                pairing.try_code("00000000", now);
            }
            assert_eq!(pairing.try_code("K7PM2F9X", now), Try::Right);
        }
    }

    #[test]
    fn only_a_phone_with_a_token_is_paired() {
        let mut pairing = pairing();
        assert_eq!((pairing.phone(""), pairing.phone(&"0".repeat(64))), (None, None));
        assert_eq!((pairing.pair([1; 32]), pairing.pair([2; 32])), (1, 2));
        assert_eq!((pairing.phone(&"01".repeat(32)), pairing.phone(&"02".repeat(32))), (Some(0), Some(1)));
        for wrong in ["", "01", &"01".repeat(31), &"01".repeat(33), &"03".repeat(32), &"10".repeat(32)] {
            assert_eq!(pairing.phone(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn with_too_many_phones_the_first_has_to_pair_again() {
        let mut pairing = pairing();
        for number in 0..=PHONES {
            pairing.pair([number as u8; 32]);
        }
        let number = |token: usize| pairing.phone(&hex::encode([token as u8; 32]));
        assert_eq!((number(0), number(1), number(PHONES)), (None, Some(1), Some(PHONES as u64)));
    }
}
