//! Encodes frames as a GIF on a thread of its own. The file is written beside its place and renamed
//! when it is complete.

use crate::file::beside;
use color_quant::NeuQuant;
use gif::{DisposalMethod, Encoder as Gif, Frame, Repeat};
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
/// Colors of a frame; one more index is for what it leaves as it is.
const COLORS: usize = 255;
/// A channel that has changed by at most this much, of 255, is left as it is. It cannot be seen, and less
/// than a palette of 255 colors is off.
const UNCHANGED: u8 = 2;
/// A channel that is shown with a larger error, of 255, is sent again: with the fewer colors of what has
/// changed, the palette comes closer.
const WRONG: u8 = 8;

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
    let mut shown = Shown::default();
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
        let frame = changes(&mut shown, &pixels);
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

/// What a film shows after its last frame.
#[derive(Debug, Default)]
struct Shown {
    /// Red, green and blue of each pixel as it was when it was sent last.
    sent: Vec<u8>,
    /// The colors of the palettes in its place.
    drawn: Vec<u8>,
}

/// The frame that changes what is shown into a picture: the rectangle of the pixels that differ, in which the
/// others are transparent. Most of a view is still, so that a film is a fraction of its pictures.
fn changes(shown: &mut Shown, pixels: &Pixels) -> Frame<'static> {
    let row = pixels.width as usize;
    let is_first = shown.sent.len() != pixels.rgb.len();
    if is_first {
        shown.sent.clone_from(&pixels.rgb);
        shown.drawn.clone_from(&pixels.rgb);
    }
    let differs = |i: &usize| {
        let mut channels = 3 * i..3 * i + 3;
        let far = |a: &[u8], at: usize| a[at].abs_diff(pixels.rgb[at]);
        channels.any(|at| far(&shown.sent, at) > UNCHANGED || far(&shown.drawn, at) > WRONG)
    };
    let all = 0..pixels.rgb.len() / 3;
    let changed: Vec<usize> = all.filter(|i| is_first || differs(i)).collect();
    let color = |i: &usize| [3 * i, 3 * i + 1, 3 * i + 2].map(|at| pixels.rgb[at]);
    let places = changed.iter().map(|i| [i % row, i / row]);
    let bounds = places.fold(None, |bounds, at| {
        let [low, high] = bounds.unwrap_or([at, at]);
        Some([
            [low[0].min(at[0]), low[1].min(at[1])],
            [high[0].max(at[0]), high[1].max(at[1])],
        ])
    });
    // A frame has at least one pixel.
    let [[left, top], [right, bottom]] = bounds.unwrap_or_default();
    let (right, bottom) = (right + 1, bottom + 1);
    let (mut palette, indices) = palette(&changed.iter().map(color).collect::<Vec<_>>());
    let transparent = (palette.len() / 3) as u8;
    palette.extend([0; 3]);
    let mut buffer = vec![transparent; (right - left) * (bottom - top)];
    for (i, index) in changed.iter().zip(indices) {
        buffer[(i / row - top) * (right - left) + i % row - left] = index;
        let (pixel, color) = (3 * i..3 * i + 3, 3 * usize::from(index));
        shown.sent[pixel.clone()].copy_from_slice(&pixels.rgb[pixel.clone()]);
        shown.drawn[pixel].copy_from_slice(&palette[color..color + 3]);
    }
    Frame {
        delay: (100 / RATE) as u16,
        dispose: DisposalMethod::Keep,
        transparent: Some(transparent),
        left: left as u16,
        top: top as u16,
        width: (right - left) as u16,
        height: (bottom - top) as u16,
        palette: Some(palette),
        buffer: buffer.into(),
        ..Frame::default()
    }
}

/// At most [`COLORS`] colors for those given, as red, green and blue, and the index of each: the same ones
/// where they are few.
fn palette(colors: &[[u8; 3]]) -> (Vec<u8>, Vec<u8>) {
    let mut distinct = BTreeMap::new();
    for color in colors {
        distinct.insert(*color, 0);
        if distinct.len() > COLORS {
            let pixels = colors.iter().flat_map(|[r, g, b]| [*r, *g, *b, u8::MAX]);
            let quantized = NeuQuant::new(SPEED, COLORS, &pixels.collect::<Vec<_>>());
            let index = |[r, g, b]: &[u8; 3]| quantized.index_of(&[*r, *g, *b, u8::MAX]) as u8;
            return (
                quantized.color_map_rgb(),
                colors.iter().map(index).collect(),
            );
        }
    }
    for (i, index) in (0..).zip(distinct.values_mut()) {
        *index = i;
    }
    let indices = colors.iter().map(|color| distinct[color]).collect();
    (distinct.into_keys().flatten().collect(), indices)
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

    /// The pictures of a film as they are shown, one over the other.
    fn shown(path: &Path) -> Vec<Vec<u8>> {
        let mut options = gif::DecodeOptions::new();
        options.set_color_output(gif::ColorOutput::RGBA);
        let file = File::open(path).expect("it is there");
        let mut film = options.read_info(file).expect("it is a GIF");
        let width = usize::from(film.width());
        let mut picture = vec![0; 3 * width * usize::from(film.height())];
        let mut all = Vec::new();
        while let Some(frame) = film.read_next_frame().expect("it is whole") {
            let pixels = frame.buffer.chunks_exact(4).enumerate();
            for (i, pixel) in pixels.filter(|(_, pixel)| pixel[3] > 0) {
                let row = usize::from(frame.top) + i / usize::from(frame.width);
                let column = usize::from(frame.left) + i % usize::from(frame.width);
                let at = 3 * (row * width + column);
                picture[at..at + 3].copy_from_slice(&pixel[..3]);
            }
            all.push(picture.clone());
        }
        all
    }

    /// A disk of a hundred colors moves over a gradient that has more than a palette holds, then rests. Each
    /// frame shows what was sent, and a still one costs next to nothing.
    #[test]
    fn frames_hold_what_changes_and_show_all() {
        let (width, height) = (96_u32, 64_u32);
        let picture = |step: u32| {
            let pixel = |i: u32| {
                let (x, y) = (i % width, i / width);
                let (dx, dy) = (x as f32 - 20.0 - 4.0 * step as f32, y as f32 - 30.0);
                match dx.hypot(dy) {
                    away if away < 10.0 => [200, (20.0 * away) as u8, 40],
                    _ => [(2 * x) as u8, (3 * y) as u8, (x + y) as u8],
                }
            };
            Pixels {
                width,
                height,
                rgb: (0..width * height).flat_map(pixel).collect(),
            }
        };
        let path = file("changes");
        let film = |count: u32, path: &Path| {
            let encoder = Encoder::create(path).expect("it can be written");
            let inlet = encoder.inlet().expect("it has not ended");
            for number in 0..count {
                inlet.announce();
                inlet.send(number.into(), Ok(picture(number.min(9))));
            }
            drop(inlet);
            assert_eq!(encoder.finish(), Ok(count));
            fs::metadata(path).expect("it is there").len()
        };
        let [one, moving, still] = [1, 10, 40].map(|count| film(count, &path));
        let frames = shown(&path);
        assert_eq!(frames.len(), 40);
        for (number, frame) in (0..).zip(&frames) {
            let wanted = picture(number.min(9)).rgb;
            let off = wanted
                .iter()
                .zip(frame)
                .map(|(a, b)| f64::from(a.abs_diff(*b)));
            let mean = off.sum::<f64>() / wanted.len() as f64;
            // A palette of 255 colors for 6144 has cells of 24 pixels, in which channels that rise by 2, 3 and
            // 2 per pixel are off by a fourth of √24 times as much, 2.9; the quantizer, which looks at a
            // tenth of the pixels, by at most four times that.
            assert!(mean < 11.6, "frame {number}: {mean}");
            // The middle of the disk was the gradient three frames before, whose red is 80 lower or more.
            let middle = 3 * (30 * width as usize + 20 + 4 * number.min(9) as usize);
            for channel in middle..middle + 3 {
                let off = wanted[channel].abs_diff(frame[channel]);
                assert!(off < 80, "frame {number}: {off}");
            }
        }
        // The disk has some 314 of 6144 pixels, and uncovers as few.
        assert!(moving - one < 5 * one, "{one} bytes, then {moving}");
        // A palette of one color, one pixel, and headers.
        assert!(still - moving < 30 * 64, "{moving} bytes, then {still}");
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
