//! Pictures of a stretch put aside in the first pass over it, so that the second need not decode the
//! footage again.

use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom, Write as _};
use std::path::PathBuf;

use crate::error::{Error, Result};
use crate::image::Picture;

/// Pictures of one size in a file, first in, first out.
pub(super) struct Spool {
    file: File,
    /// Where the file is, for messages.
    folder: PathBuf,
    size: (usize, usize),
    put: usize,
    taken: usize,
}

impl Spool {
    /// An empty one for pictures of `size`, in a file of `folder` that nobody else uses.
    pub(super) fn new(file: File, folder: PathBuf, size: (usize, usize)) -> Self {
        Self { file, folder, size, put: 0, taken: 0 }
    }

    /// Puts a picture behind the others. Once all were taken their place is used again.
    ///
    /// # Errors
    /// [`Error::Io`], for a full disk say.
    ///
    /// # Panics
    /// When the picture has another size.
    pub(super) fn put(&mut self, picture: &Picture) -> Result<()> {
        assert_eq!((picture.width(), picture.height()), self.size, "pictures of one size");
        if self.taken == self.put {
            (self.put, self.taken) = (0, 0);
        }
        self.go_to(self.put)
            .and_then(|()| self.file.write_all(picture.rgb()))
            .map_err(Error::io(&self.folder, "put pictures aside in"))?;
        self.put += 1;
        Ok(())
    }

    /// The next picture; `None` when all were taken.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub(super) fn take(&mut self) -> Result<Option<Picture>> {
        if self.taken == self.put {
            return Ok(None);
        }
        let mut rgb = vec![0; self.bytes()];
        self.go_to(self.taken)
            .and_then(|()| self.file.read_exact(&mut rgb))
            .map_err(Error::io(&self.folder, "read the pictures put aside in"))?;
        self.taken += 1;
        Ok(Picture::from_rgb(self.size.0, self.size.1, rgb))
    }

    fn bytes(&self) -> usize {
        3 * self.size.0 * self.size.1
    }

    fn go_to(&mut self, picture: usize) -> std::io::Result<()> {
        self.file.seek(SeekFrom::Start((picture * self.bytes()) as u64)).map(|_| ())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_come_back_in_order_and_leave_their_place_to_others() {
        let picture = |k: u8| Picture::from_rgb(3, 2, (0..18).map(|at| 20 * k + at).collect());
        let mut spool = Spool::new(tempfile::tempfile().unwrap(), PathBuf::new(), (3, 2));
        for stretch in [0..4, 4..6, 6..11] {
            for k in stretch.clone() {
                spool.put(&picture(k).unwrap()).unwrap();
            }
            for k in stretch {
                assert_eq!(spool.take().unwrap(), picture(k));
            }
            assert_eq!(spool.take().unwrap(), None);
        }
        assert_eq!(spool.file.metadata().unwrap().len(), 5 * 18);
    }
}
