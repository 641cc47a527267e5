//! The second step of parsing: flags that are small languages of their own.

use std::fmt;

/// A flag whose text cannot be understood; ends the program with exit code 2.
#[derive(Debug)]
pub(crate) struct WrongUsage {
    flag: &'static str,
    text: String,
    form: &'static str,
}

impl fmt::Display for WrongUsage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} «{}»: expected {}", self.flag, self.text, self.form)
    }
}

impl std::error::Error for WrongUsage {}

/// A complaint about a flag.
pub(crate) fn wrong(flag: &'static str, text: &str, form: &'static str) -> WrongUsage {
    WrongUsage { flag, text: text.to_owned(), form }
}

/// `x,y,w,h`.
pub(crate) fn rectangle(flag: &'static str, text: &str) -> Result<[usize; 4], WrongUsage> {
    let numbers: Option<Vec<usize>> = text.split(',').map(|n| n.trim().parse().ok()).collect();
    numbers
        .and_then(|n| <[usize; 4]>::try_from(n).ok())
        .ok_or_else(|| wrong(flag, text, "left,top,width,height in whole pixels"))
}

/// `3,7,20-25`: frames or counts, ranges included.
pub(crate) fn list(flag: &'static str, text: &str) -> Result<Vec<usize>, WrongUsage> {
    let fail = || wrong(flag, text, "whole numbers and ranges like 3,7,20-25");
    let mut numbers = Vec::new();
    for part in text.split(',').map(str::trim).filter(|p| !p.is_empty()) {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        let (first, last): (usize, usize) =
            (first.trim().parse().map_err(|_| fail())?, last.trim().parse().map_err(|_| fail())?);
        if first > last || last > 10_000_000 {
            return Err(fail());
        }
        numbers.extend(first..=last);
    }
    if numbers.is_empty() { Err(fail()) } else { Ok(numbers) }
}

/// `K=F`.
pub(crate) fn pair(flag: &'static str, text: &str) -> Result<[usize; 2], WrongUsage> {
    text.split_once('=')
        .and_then(|(k, f)| Some([k.trim().parse().ok()?, f.trim().parse().ok()?]))
        .ok_or_else(|| wrong(flag, text, "KEY=FRAME"))
}

/// `WxH`.
pub(crate) fn size(flag: &'static str, text: &str) -> Result<(usize, usize), WrongUsage> {
    text.split_once(['x', '×'])
        .and_then(|(w, h)| Some((w.trim().parse().ok()?, h.trim().parse().ok()?)))
        .filter(|&(w, h): &(usize, usize)| (8..=16_384).contains(&w) && (8..=16_384).contains(&h))
        .ok_or_else(|| wrong(flag, text, "WIDTHxHEIGHT, each 8 to 16384"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_hold_numbers_and_ranges() {
        assert_eq!(list("--keys", "2-5").unwrap(), [2, 3, 4, 5]);
        assert_eq!(list("--exclude", "3, 7,20-22").unwrap(), [3, 7, 20, 21, 22]);
        for bad in ["", "x", "5-2", "1,,b", "-3"] {
            assert!(list("--keys", bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn rectangles_sizes_and_pairs() {
        assert_eq!(rectangle("--foreground", "1, 2,3,4").unwrap(), [1, 2, 3, 4]);
        assert!(rectangle("--foreground", "1,2,3").is_err());
        assert!(rectangle("--foreground", "1,2,3,-4").is_err());
        assert_eq!(size("--size", "320x240").unwrap(), (320, 240));
        assert!(size("--size", "0x240").is_err());
        assert_eq!(pair("--partner", "2=31").unwrap(), [2, 31]);
        assert!(pair("--partner", "2-31").is_err());
    }
}
