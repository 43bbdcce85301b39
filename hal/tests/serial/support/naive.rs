//! Reference decoders that process all bytes at once, written from the description of the protocols alone. They return the
//! valid values.

/// capaNCDT answers: raw counts of valid values, leftmost answer first.
pub fn capancdt(bytes: &[u8]) -> Vec<i64> {
    let (mut values, mut at, mut before) = (Vec::new(), 0, None);
    while at < bytes.len() {
        let Some(m) = (0..=20).find(|m| is_answer(&bytes[at..], *m)) else {
            at += 1;
            continue;
        };
        let data = &bytes[at + 7..];
        let counter = i64::from(data[0]) + 256 * i64::from(data[1]);
        let advance = before.map_or(m as i64, |before: i64| (counter - before).rem_euclid(65536));
        let fresh = if advance >= 32768 {
            0
        } else {
            (m as i64).min(advance)
        };
        for index in (0..m)
            .rev()
            .take(fresh as usize)
            .collect::<Vec<_>>()
            .into_iter()
            .rev()
        {
            let four = &data[4 + 4 * index..8 + 4 * index];
            let raw = four
                .iter()
                .rev()
                .fold(0i64, |sum, byte| 256 * sum + i64::from(*byte));
            values.extend((raw <= 0xF0_0000).then_some(raw)); // a set sign bit makes raw large, too
        }
        before = Some(counter);
        at += 13 + 4 * m;
    }
    values
}

fn is_answer(bytes: &[u8], m: usize) -> bool {
    let le = (7 + 4 * m) as u8;
    if bytes.len() < 13 + 4 * m
        || bytes[..7] != [0x68, le, le, 0x68, 0x01, 0x7E, 0x08]
        || bytes[9] != m as u8
    {
        return false;
    }
    let sum: u32 = bytes[4..11 + 4 * m]
        .iter()
        .map(|byte| u32::from(*byte))
        .sum();
    bytes[11 + 4 * m..13 + 4 * m] == [(sum % 256) as u8, 0x16]
}

/// optoNCDT stream of one value a cycle: raw counts of valid values.
pub fn optoncdt(bytes: &[u8]) -> Vec<i64> {
    let messages = bytes
        .windows(3)
        .filter(|b| b[0] < 0x40 && (0x40..0x80).contains(&b[1]) && (0x80..0xC0).contains(&b[2]));
    let counts = messages
        .map(|b| i64::from(b[0]) + 64 * i64::from(b[1] - 0x40) + 4096 * i64::from(b[2] - 0x80));
    counts.filter(|x| (643..=64877).contains(x)).collect()
}

/// Lines of `{value:8.4}` ended by CR: digits of valid values within +-`half_range_mm`.
pub fn keyence(bytes: &[u8], half_range_mm: f64) -> Vec<i64> {
    let text: String = bytes.iter().map(|byte| char::from(*byte)).collect();
    let mut lines: Vec<&str> = text.split('\r').collect();
    lines.pop(); // without terminator
    lines
        .iter()
        .skip(1)
        .filter_map(|line| keyence_line(line, half_range_mm))
        .collect()
}

fn keyence_line(line: &str, half_range_mm: f64) -> Option<i64> {
    let number = line.trim_start_matches(' ');
    let is_written = number
        .chars()
        .enumerate()
        .all(|(at, c)| c.is_ascii_digit() || c == '.' || (at == 0 && "+-".contains(c)));
    if line.chars().count() != 8
        || !is_written
        || line.chars().nth(3) != Some('.')
        || number.matches('.').count() != 1
    {
        return None;
    }
    let millimetres: f64 = number.parse().ok()?;
    (millimetres.abs() <= half_range_mm).then_some((millimetres * 1e4).round() as i64)
}
