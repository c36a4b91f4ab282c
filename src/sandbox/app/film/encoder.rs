//! Encodes frames as a GIF on a thread of its own. The file is written beside its place and renamed
//! when it is complete.

use crate::file::beside;
use gif::{Encoder as Gif, Frame, Repeat};
use std::{
    collections::BTreeMap,
    fs::{self, File},
    io::BufWriter,
    path::{Path, PathBuf},
    sync::{
        Arc, Mutex, Weak,
        atomic::{AtomicUsize, Ordering},
        mpsc::{Receiver, Sender, channel},
    },
    thread::{self, JoinHandle},
};

/// Frames per second of a film.
pub const RATE: u64 = 25;
/// Quality of the colors of a frame, from 1 (best) to 30 (fastest).
const SPEED: i32 = 10;

/// A picture of eight bits per channel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pixels {
    /// Width [px].
    pub width: u32,
    /// Height [px].
    pub height: u32,
    /// Red, green and blue of each pixel, by rows from the top.
    pub rgb: Vec<u8>,
}

/// What is sent to the encoder.
#[derive(Debug)]
enum Sent {
    /// A frame: its number, and its pixels or why there are none.
    Frame(u64, Result<Pixels, String>),
    /// The film ends without the frames that are still missing.
    Cut,
}

/// A film that is being encoded.
#[derive(Debug)]
pub struct Encoder {
    path: PathBuf,
    inlet: Option<Inlet>,
    /// Of the inlets that still exist.
    sender: Weak<Mutex<Sender<Sent>>>,
    waiting: Arc<AtomicUsize>,
    thread: JoinHandle<Result<u32, String>>,
}

/// Where frames are sent to. The film ends when there is none left.
#[derive(Debug, Clone)]
pub struct Inlet {
    sender: Arc<Mutex<Sender<Sent>>>,
    waiting: Arc<AtomicUsize>,
}

impl Inlet {
    /// Announces a frame that will be sent.
    pub fn announce(&self) {
        self.waiting.fetch_add(1, Ordering::Relaxed);
    }

    /// Sends a frame that was announced. Frames may arrive in another order.
    pub fn send(&self, number: u64, pixels: Result<Pixels, String>) {
        if let Ok(sender) = self.sender.lock() {
            // An encoder that has failed takes nothing more.
            let _ = sender.send(Sent::Frame(number, pixels));
        }
    }
}

impl Encoder {
    /// Starts a film that will be in a file.
    ///
    /// # Errors
    /// The message of the system.
    pub fn create(path: &Path) -> Result<Self, String> {
        let file = File::create(beside(path)).map_err(|error| error.to_string())?;
        let (sender, frames) = channel();
        let waiting = Arc::new(AtomicUsize::new(0));
        let (counter, target) = (Arc::clone(&waiting), path.to_owned());
        let thread = thread::spawn(move || {
            let written = encode(file, &frames, &counter);
            let written = written.and_then(|count| {
                let renamed = match count {
                    0 => return Err("no frame was taken".to_owned()),
                    _ => fs::rename(beside(&target), &target),
                };
                renamed.map_err(|error| error.to_string())?;
                Ok(count)
            });
            if written.is_err() {
                // Incomplete, and of no use.
                let _ = fs::remove_file(beside(&target));
            }
            written
        });
        let sender = Arc::new(Mutex::new(sender));
        Ok(Self {
            path: path.to_owned(),
            sender: Arc::downgrade(&sender),
            inlet: Some(Inlet {
                sender,
                waiting: Arc::clone(&waiting),
            }),
            waiting,
            thread,
        })
    }

    /// The file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Number of frames that were announced and are not encoded yet.
    #[must_use]
    pub fn waiting(&self) -> usize {
        self.waiting.load(Ordering::Relaxed)
    }

    /// Whether encoding has ended before the film, by an error.
    #[must_use]
    pub fn failed(&self) -> bool {
        self.inlet.is_some() && self.thread.is_finished()
    }

    /// Where frames are sent to, until the film ends.
    #[must_use]
    pub fn inlet(&self) -> Option<Inlet> {
        self.inlet.clone()
    }

    /// Ends the film: it is complete when all frames that were announced are encoded.
    pub fn end(&mut self) {
        self.inlet = None;
    }

    /// Whether the file is written, or has failed.
    #[must_use]
    pub fn is_finished(&self) -> bool {
        self.thread.is_finished()
    }

    /// Ends the film without the frames that were announced and have not arrived: when the window
    /// closes, they never will.
    pub fn cut(&mut self) {
        self.inlet = None;
        let sender = self.sender.upgrade();
        if let Some(sender) = sender.as_ref().and_then(|sender| sender.lock().ok()) {
            // An encoder that has ended takes nothing more.
            let _ = sender.send(Sent::Cut);
        }
    }

    /// Waits for the end of encoding. Returns the number of frames.
    ///
    /// # Errors
    /// The message of the system, for the user.
    pub fn finish(mut self) -> Result<u32, String> {
        self.end();
        let ended = self.thread.join();
        ended.unwrap_or_else(|_| Err("the encoder has failed".to_owned()))
    }

    /// Ends a film without frames, and leaves no file.
    pub fn abandon(mut self) {
        self.end();
        // That nothing was taken is no error here.
        let _ = self.finish();
    }
}

/// Writes frames in the order of their numbers until there is no inlet left. Returns their number.
fn encode(file: File, frames: &Receiver<Sent>, waiting: &AtomicUsize) -> Result<u32, String> {
    let mut early = BTreeMap::new();
    let mut next = 0;
    let mut film: Option<Gif<BufWriter<File>>> = None;
    let mut file = Some(file);
    let mut count = 0;
    let mut write = |pixels: Pixels| -> Result<(), String> {
        let (width, height) = (side(pixels.width)?, side(pixels.height)?);
        let gif = match &mut film {
            Some(gif) => gif,
            none => {
                let file = file.take().ok_or("the file is closed")?;
                let gif = Gif::new(BufWriter::new(file), width, height, &[]);
                let mut gif = gif.map_err(|error| error.to_string())?;
                let repeat = gif.set_repeat(Repeat::Infinite);
                repeat.map_err(|error| error.to_string())?;
                none.insert(gif)
            }
        };
        let mut frame = Frame::from_rgb_speed(width, height, &pixels.rgb, SPEED);
        frame.delay = (100 / RATE) as u16;
        gif.write_frame(&frame).map_err(|error| error.to_string())?;
        count += 1;
        Ok(())
    };
    for sent in frames {
        let Sent::Frame(number, pixels) = sent else {
            break;
        };
        early.insert(number, pixels?);
        while let Some(pixels) = early.remove(&next) {
            write(pixels)?;
            waiting.fetch_sub(1, Ordering::Relaxed);
            next += 1;
        }
    }
    // Frames after one that never arrived.
    for pixels in early.into_values() {
        write(pixels)?;
    }
    if let Some(gif) = film {
        let buffer = gif.into_inner().map_err(|error| error.to_string())?;
        let file = buffer.into_inner().map_err(|error| error.to_string())?;
        file.sync_all().map_err(|error| error.to_string())?;
    }
    Ok(count)
}

fn side(pixels: u32) -> Result<u16, String> {
    u16::try_from(pixels).map_err(|_| format!("a side has {pixels} px, but at most 65535 fit"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(shade: u8) -> Pixels {
        Pixels {
            width: 4,
            height: 2,
            rgb: vec![shade; 24],
        }
    }

    fn file(test: &str) -> PathBuf {
        std::env::temp_dir().join(format!("pliant-film-{test}-{}.gif", std::process::id()))
    }

    #[test]
    fn a_film_reads_back_in_order_with_its_rate_however_frames_arrive() {
        let path = file("order");
        let mut encoder = Encoder::create(&path).expect("it can be written");
        let inlet = encoder.inlet().expect("it has not ended");
        for number in [1, 0, 3, 2] {
            inlet.announce();
            inlet.send(number, Ok(picture(10 + 60 * number as u8)));
        }
        assert!(!path.exists(), "it is written beside its place");
        encoder.end();
        drop(inlet);
        assert_eq!(encoder.finish(), Ok(4));
        let mut options = gif::DecodeOptions::new();
        options.set_color_output(gif::ColorOutput::RGBA);
        let file = File::open(&path).expect("it is there");
        let mut film = options.read_info(file).expect("it is a GIF");
        assert_eq!((film.width(), film.height()), (4, 2));
        for number in 0..4 {
            let frame = film
                .read_next_frame()
                .expect("it is whole")
                .expect("a frame");
            assert_eq!(frame.delay, 4, "25 frames per second");
            assert_eq!(frame.buffer[0], 10 + 60 * number, "frame {number}");
        }
        assert!(film.read_next_frame().expect("it is whole").is_none());
        assert!(!beside(&path).exists());
        fs::remove_file(&path).expect("it was made here");
    }

    /// When the window closes, frames that the renderer has not delivered keep their inlet.
    #[test]
    fn a_film_that_is_cut_does_not_wait_for_frames_that_never_arrive() {
        let path = file("cut");
        let mut encoder = Encoder::create(&path).expect("it can be written");
        let inlet = encoder.inlet().expect("it has not ended");
        inlet.announce();
        inlet.send(0, Ok(picture(10)));
        inlet.announce();
        encoder.end();
        encoder.cut();
        assert_eq!(encoder.finish(), Ok(1));
        drop(inlet);
        fs::remove_file(&path).expect("it was made here");
    }

    #[test]
    fn a_film_that_fails_or_has_no_frame_leaves_no_file() {
        let path = file("nothing");
        Encoder::create(&path).expect("it can be written").abandon();
        let encoder = Encoder::create(&path).expect("it can be written");
        let inlet = encoder.inlet().expect("it has not ended");
        inlet.send(0, Err("no picture".to_owned()));
        drop(inlet);
        assert_eq!(encoder.finish(), Err("no picture".to_owned()));
        assert!(!path.exists() && !beside(&path).exists());
        let nowhere = Path::new("/no such folder/film.gif");
        assert!(Encoder::create(nowhere).is_err());
    }
}
