//! A peer in a process of its own, which answers lines of text.

use crate::peer::PeerError;
use std::{
    io::{BufRead, BufReader, Read, Write},
    process::{Child, ChildStdin, Command, Stdio},
    sync::{
        Arc, Mutex, PoisonError,
        mpsc::{self, Receiver, RecvTimeoutError},
    },
    thread,
    time::Duration,
};

/// A process that answers each line with a line. It is killed when this is dropped.
pub struct Process {
    child: Child,
    input: ChildStdin,
    lines: Receiver<String>,
    /// The last line of its standard error.
    complaint: Arc<Mutex<String>>,
    /// Why it does not answer any more.
    failure: Option<String>,
}

impl Process {
    /// Starts a command.
    ///
    /// # Errors
    /// [`PeerError::Process`] if it cannot be started.
    pub fn start(command: &mut Command) -> Result<Self, PeerError> {
        let program = command.get_program().to_owned();
        let failed = |reason: &dyn std::fmt::Display| {
            let program = program.display();
            PeerError::Process(format!("{program} cannot be started: {reason}"))
        };
        let mut child = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(|error| failed(&error))?;
        let pipes = (child.stdin.take(), child.stdout.take(), child.stderr.take());
        let (Some(input), Some(output), Some(errors)) = pipes else {
            return Err(failed(&"it has no pipes"));
        };
        let (sender, lines) = mpsc::channel();
        each_line(output, move |line| sender.send(line).is_ok());
        let complaint = Arc::new(Mutex::new(String::new()));
        let last = Arc::clone(&complaint);
        each_line(errors, move |line| {
            if !line.trim().is_empty() {
                *last.lock().unwrap_or_else(PoisonError::into_inner) = line;
            }
            true
        });
        Ok(Self {
            child,
            input,
            lines,
            complaint,
            failure: None,
        })
    }

    /// Sends a line, and returns the answer.
    ///
    /// # Errors
    /// [`PeerError::Process`] if it has ended, or does not answer within a time, after which it is
    /// killed; the same for all later lines.
    pub fn ask(&mut self, line: &str, limit: Duration) -> Result<String, PeerError> {
        if let Some(reason) = &self.failure {
            return Err(PeerError::Process(reason.clone()));
        }
        // If it has ended, there is no answer, and the reason is known below.
        let _ = writeln!(self.input, "{line}").and_then(|()| self.input.flush());
        self.lines.recv_timeout(limit).map_err(|error| {
            let reason = match error {
                RecvTimeoutError::Timeout => self.hung(limit),
                RecvTimeoutError::Disconnected => self.ended(),
            };
            self.failure = Some(reason.clone());
            PeerError::Process(reason)
        })
    }

    /// Whether it has ended or was killed.
    #[must_use]
    pub fn has_failed(&self) -> bool {
        self.failure.is_some()
    }

    /// Kills it.
    fn hung(&mut self, limit: Duration) -> String {
        // It may have ended meanwhile.
        let _ = self.child.kill();
        format!(
            "no answer within {} s; leave out the row with --rows if it happens again",
            limit.as_secs_f64()
        )
    }

    /// Says how the process ended.
    fn ended(&mut self) -> String {
        let status = match self.child.wait() {
            Ok(status) => status.to_string(),
            Err(error) => error.to_string(),
        };
        // The other thread may still read the last line.
        thread::sleep(Duration::from_millis(50));
        let complaint = self
            .complaint
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        let said = match complaint.as_str() {
            "" => "it said nothing",
            line => line,
        };
        format!("it ended ({status}): {said}")
    }
}

/// Reads lines in a thread until the stream or the interest ends.
fn each_line(
    stream: impl Read + Send + 'static,
    mut take: impl FnMut(String) -> bool + Send + 'static,
) {
    thread::spawn(move || {
        let lines = BufReader::new(stream).lines();
        for line in lines.map_while(Result::ok) {
            if !take(line) {
                break;
            }
        }
    });
}

impl Drop for Process {
    fn drop(&mut self) {
        // The process may already have ended.
        if self.child.kill().is_ok() {
            let _ = self.child.wait();
        }
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    fn shell(script: &str) -> Process {
        Process::start(Command::new("sh").args(["-c", script])).expect("it starts")
    }

    const LONG: Duration = Duration::from_secs(60);

    #[test]
    fn each_line_has_an_answer() {
        let mut echo = shell("while read -r line; do echo \"<$line>\"; done");
        assert_eq!(echo.ask("a", LONG).expect("it answers"), "<a>");
        assert_eq!(echo.ask("b c", LONG).expect("it answers"), "<b c>");
    }

    #[test]
    fn a_process_that_ends_is_reported_with_its_last_words() {
        let mut broken = shell("echo 'no module named newton' >&2; exit 3");
        let error = broken.ask("a", LONG).expect_err("it ends").to_string();
        assert!(error.contains("no module named newton"), "{error}");
        assert!(error.contains("exit status: 3"), "{error}");
        assert!(broken.has_failed());
    }

    #[test]
    fn a_process_that_hangs_is_given_up() {
        let mut hanging = shell("exec sleep 600");
        // The second time without waiting.
        for limit in [Duration::from_millis(20), LONG] {
            let error = hanging.ask("a", limit);
            let error = error.expect_err("it hangs").to_string();
            assert!(error.contains("no answer within 0.02 s"), "{error}");
        }
    }
}
