//! Reading ahead: the next frames are decoded while the last ones are worked on.

use std::sync::mpsc::{Receiver, sync_channel};
use std::thread;

use super::FrameSource;
use crate::error::{Error, Result};
use crate::image::{Frame, Picture};

/// What a source says before it is read.
struct Head {
    width: usize,
    height: usize,
    fps: Option<f64>,
    frame_count: Option<usize>,
}

/// How far ahead of what is worked on is decoded.
#[derive(Clone, Copy, Debug)]
pub struct Ahead {
    /// So many frames, whatever their size; at least one.
    pub frames: usize,
    /// More of small frames, up to so many pixels in all.
    pub pixels: usize,
}

/// A source that is opened and decoded in a thread of its own, some frames ahead. Frames and errors come in
/// the same order as without.
///
/// # Errors
/// Those of `open`.
pub fn read_ahead(
    open: impl FnOnce() -> Result<Box<dyn FrameSource>> + Send + 'static,
    ahead: Ahead,
) -> Result<Box<dyn FrameSource>> {
    let (say_head, head) = sync_channel(1);
    // Sending fails when nobody listens any more: the work was given up.
    let read = move || {
        let mut source = match open() {
            Ok(source) => source,
            Err(error) => return say_head.send(Err(error)).is_ok(),
        };
        let head = Head {
            width: source.width(),
            height: source.height(),
            fps: source.fps(),
            frame_count: source.frame_count(),
        };
        let small = ahead.pixels / (head.width * head.height).max(1);
        let (send, receiver) = sync_channel(ahead.frames.max(small).max(1));
        let mut heard = say_head.send(Ok((head, receiver))).is_ok();
        while heard {
            let next = source.next_stored();
            let last = !matches!(next, Ok(Some(_)));
            heard = send.send(next).is_ok() && !last;
        }
        heard
    };
    let started = thread::Builder::new().name("read ahead".to_owned()).spawn(read);
    // Only a machine at its limits refuses a thread; nothing could be read then.
    started.map_err(|_| Error::Interrupted)?;
    let (head, receiver) = head.recv().unwrap_or(Err(Error::Interrupted))?;
    Ok(Box::new(ReadAhead { head, receiver, ended: false }))
}

struct ReadAhead {
    head: Head,
    receiver: Receiver<Result<Option<Frame>>>,
    ended: bool,
}

impl FrameSource for ReadAhead {
    fn width(&self) -> usize {
        self.head.width
    }

    fn height(&self) -> usize {
        self.head.height
    }

    fn fps(&self) -> Option<f64> {
        self.head.fps
    }

    fn frame_count(&self) -> Option<usize> {
        self.head.frame_count
    }

    fn next_frame(&mut self) -> Result<Option<Picture>> {
        Ok(self.next_stored()?.map(Frame::into_rgb))
    }

    fn next_stored(&mut self) -> Result<Option<Frame>> {
        if self.ended {
            return Ok(None);
        }
        // The thread ends only after it has sent the end or an error.
        let next = self.receiver.recv().unwrap_or(Ok(None));
        self.ended = !matches!(next, Ok(Some(_)));
        next
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Frames of one grey pixel, counted from 0, then an error or the end.
    struct Counting {
        next: u8,
        frames: u8,
        fails: bool,
    }

    impl FrameSource for Counting {
        fn width(&self) -> usize {
            1
        }
        fn height(&self) -> usize {
            1
        }
        fn fps(&self) -> Option<f64> {
            Some(25.0)
        }
        fn frame_count(&self) -> Option<usize> {
            Some(usize::from(self.frames))
        }
        fn next_frame(&mut self) -> Result<Option<Picture>> {
            if self.next == self.frames {
                return if self.fails { Err(Error::Interrupted) } else { Ok(None) };
            }
            self.next += 1;
            Ok(Picture::from_rgb(1, 1, vec![self.next - 1; 3]))
        }
    }

    #[test]
    fn frames_errors_and_the_end_come_in_order() {
        for (ahead, frames, fails) in [(1, 5, true), (3, 5, false), (9, 0, true)] {
            let ahead = Ahead { frames: ahead, pixels: 2 };
            let counting = Counting { next: 0, frames, fails };
            let mut source = read_ahead(move || Ok(Box::new(counting)), ahead).unwrap();
            assert_eq!(source.frame_count(), Some(usize::from(frames)));
            for k in 0..frames {
                assert_eq!(source.next_frame().unwrap().unwrap().rgb(), [k; 3]);
            }
            assert_eq!(source.next_frame().is_err(), fails);
            assert!(source.next_frame().unwrap().is_none(), "an end stays an end");
        }
        let ahead = Ahead { frames: 2, pixels: 0 };
        assert!(read_ahead(|| Err(Error::Interrupted), ahead).is_err());
    }

    #[test]
    fn a_source_that_is_given_up_does_not_block() {
        let counting = Counting { next: 0, frames: 200, fails: false };
        let ahead = Ahead { frames: 2, pixels: 9 };
        let mut source = read_ahead(move || Ok(Box::new(counting)), ahead).unwrap();
        assert!(source.next_frame().unwrap().is_some());
        drop(source);
    }
}
