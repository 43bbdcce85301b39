//! In which order the entries of an array are taken from its data.

use std::ops::Range;

/// Places of the entries in the data, in the order in which the first index runs fastest.
pub(crate) struct Places {
    count: usize,
    /// Rows and columns of a matrix whose rows are stored one after the other.
    by_row: Option<[usize; 2]>,
}

impl Places {
    /// Those of an array of this shape with so many entries, which is stored with the first index fastest (`is_fortran`) or the last.
    pub fn new(shape: &[usize], is_fortran: bool, count: usize) -> Places {
        let mut long = shape.iter().copied().filter(|size| *size != 1);
        let by_row = match (is_fortran, long.next(), long.next(), long.next()) {
            (false, Some(rows), Some(columns), None) if count > 0 => Some([rows, columns]),
            _ => None,
        };
        Places { count, by_row }
    }

    /// Number of entries.
    pub fn count(&self) -> usize {
        self.count
    }

    /// A part of each entry, which has so many bytes; entries beyond the end of the data are left out.
    pub fn items<'a>(
        &self,
        data: &'a [u8],
        entry_bytes: usize,
        part: Range<usize>,
    ) -> impl Iterator<Item = &'a [u8]> + Clone + use<'a> {
        self.iter().filter_map(move |place| {
            let start = place.checked_mul(entry_bytes)?;
            let part = start.checked_add(part.start)?..start.checked_add(part.end)?;
            data.get(part)
        })
    }

    fn iter(&self) -> impl Iterator<Item = usize> + Clone + use<> {
        let [rows, columns] = self.by_row.unwrap_or([self.count, 1]);
        (0..columns).flat_map(move |column| (0..rows).map(move |row| row * columns + column))
    }
}
