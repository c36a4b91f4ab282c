//! A background thread for an instrument.

use std::{
    io,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
        mpsc::{self, Receiver, Sender},
    },
    thread,
};

/// Handle of a background thread and its messages. Dropping it tells the thread to stop.
#[derive(Debug)]
pub struct Worker<News> {
    news: Mutex<Receiver<News>>,
    stop: Arc<AtomicBool>,
}

/// Sends messages from the background thread.
#[derive(Debug)]
pub struct Reporter<News> {
    sender: Sender<News>,
    stop: Arc<AtomicBool>,
}

impl<News: Send + 'static> Worker<News> {
    /// Starts a thread with the given name.
    ///
    /// # Errors
    /// If the thread cannot be started.
    pub fn start(
        name: &str,
        work: impl FnOnce(&Reporter<News>) + Send + 'static,
    ) -> io::Result<Self> {
        let (sender, news) = mpsc::channel();
        let stop = Arc::new(AtomicBool::new(false));
        let reporter = Reporter {
            sender,
            stop: Arc::clone(&stop),
        };
        thread::Builder::new()
            .name(name.to_owned())
            .spawn(move || work(&reporter))?;
        Ok(Self {
            news: Mutex::new(news),
            stop,
        })
    }

    /// Messages since the last call.
    pub fn news(&self) -> Vec<News> {
        let news = self.news.lock().unwrap_or_else(PoisonError::into_inner);
        news.try_iter().collect()
    }
}

impl<News> Drop for Worker<News> {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

impl<News> Reporter<News> {
    /// Sends a message. Returns whether the work is to continue.
    pub fn tell(&self, news: News) -> bool {
        !self.is_stopped() && self.sender.send(news).is_ok()
    }

    /// Whether the worker was dropped, so that the work should end.
    pub fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}
