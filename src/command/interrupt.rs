//! Ctrl-C as a request: a command ends early and writes what it has. A second one ends the program
//! at once.

use std::{
    ops::ControlFlow,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

/// Exit code of a command that was stopped, by the convention of shells: 128 and SIGINT.
pub const STOPPED: u8 = 130;

/// Whether Ctrl-C was pressed.
#[derive(Debug, Clone, Default)]
pub struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// Watches for Ctrl-C from now on. Where the system does not let it, Ctrl-C ends the program.
    pub fn watch() -> Self {
        let interrupt = Self::default();
        let pressed = interrupt.clone();
        let _not_watched = ctrlc::set_handler(move || {
            if pressed.0.swap(true, Ordering::Relaxed) {
                std::process::exit(STOPPED.into());
            }
        });
        interrupt
    }

    /// From now on the first Ctrl-C ends the program.
    pub fn release(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether to go on.
    pub fn flow(&self) -> ControlFlow<()> {
        match self.0.load(Ordering::Relaxed) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }
}
