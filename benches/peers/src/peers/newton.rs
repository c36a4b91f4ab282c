//! Newton, in a separate Python process; see also `newton.py`.
//!
//! The protocol is one line per message: a scene as JSON, then `tick` and `report`. The measured
//! time of a tick includes that of its message, some tens of microseconds.

use crate::{
    peer::{Counts, Peer, PeerError, Report, Run},
    scenes::{GRAVITY, RATE, SUBSTEPS, Scene},
};
use glam::Vec3;
use serde::Deserialize;
use std::{
    io::{BufRead, BufReader, Write},
    path::{Path, PathBuf},
    process::{Child, ChildStdin, ChildStdout, Command, Stdio},
};

const SCRIPT: &str = include_str!("newton.py");

/// Newton, if it is installed for this Python.
///
/// # Errors
/// [`PeerError::Missing`] if it cannot be imported.
pub fn find(python: &Path) -> Result<Box<dyn Peer>, PeerError> {
    let missing = |reason: String| {
        let python = python.display();
        PeerError::Missing(format!("{python} cannot import it ({reason})"))
    };
    let output = Command::new(python)
        .args(["-c", "import newton; print(newton.__version__)"])
        .output()
        .map_err(|error| missing(error.to_string()))?;
    let lines = |bytes: &[u8]| {
        let text = String::from_utf8_lossy(bytes);
        text.lines().last().unwrap_or("it said nothing").to_owned()
    };
    if !output.status.success() {
        return Err(missing(lines(&output.stderr)));
    }
    Ok(Box::new(Newton {
        python: python.into(),
        version: lines(&output.stdout),
    }))
}

struct Newton {
    python: PathBuf,
    version: String,
}

impl Peer for Newton {
    fn name(&self) -> &'static str {
        "Newton"
    }

    fn version(&self) -> String {
        format!("{} (Warp, CPU)", self.version)
    }

    fn settings(&self) -> &'static str {
        "`SolverXPBD` on the CPU, one iteration a step, a step a substep. It projects by Jacobi \
         with sums left undamped, so edges and tetrahedra are made as soft as twelve and \
         twenty-four to a particle need to stay stable; a tetrahedron is two constraints, shape and volume, and counts as two. Each \
         step has an overhead of kernel launches, which small scenes see. One thread."
    }

    fn is_parallel(&self) -> bool {
        false
    }

    fn build(&self, scene: &Scene, _threads: usize) -> Result<Box<dyn Run>, PeerError> {
        let failed = |error: std::io::Error| PeerError::Process(error.to_string());
        let mut process = Command::new(&self.python)
            .args(["-c", SCRIPT])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .map_err(failed)?;
        let pipes = process.stdin.take().zip(process.stdout.take());
        let (input, output) = pipes.ok_or_else(|| PeerError::Process("it has no pipes".into()))?;
        let mut running = Running {
            process,
            input,
            output: BufReader::new(output),
        };
        let shape = &scene.shape;
        let description = serde_json::json!({
            "vertices": shape.vertices,
            "inverse_masses": scene.inverse_masses,
            "edges": shape.edges,
            "tetrahedra": shape.tetrahedra,
            "offsets": scene.offsets,
            "gravity": GRAVITY,
            "step": 1.0 / f64::from(RATE) / f64::from(SUBSTEPS),
            "substeps": SUBSTEPS,
        });
        running.ask(&description.to_string())?;
        Ok(Box::new(running))
    }
}

struct Running {
    process: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
}

#[derive(Deserialize)]
struct Answer {
    edges: u64,
    tetrahedra: u64,
    /// Three numbers per particle; `null` if not finite.
    positions: Vec<[Option<f32>; 3]>,
}

impl Running {
    fn ask(&mut self, line: &str) -> Result<String, PeerError> {
        let mut answer = String::new();
        writeln!(self.input, "{line}")
            .and_then(|()| self.input.flush())
            .and_then(|()| self.output.read_line(&mut answer))
            .map_err(|error| PeerError::Process(error.to_string()))?;
        if answer.is_empty() {
            return Err(PeerError::Process("it ended early".into()));
        }
        Ok(answer)
    }
}

impl Run for Running {
    fn tick(&mut self) -> Result<(), PeerError> {
        self.ask("tick").map(drop)
    }

    fn report(&mut self) -> Result<Report, PeerError> {
        let answer: Answer = serde_json::from_str(&self.ask("report")?)
            .map_err(|error| PeerError::Process(error.to_string()))?;
        let number = |x: Option<f32>| x.unwrap_or(f32::NAN);
        Ok(Report {
            counts: Counts {
                edges: answer.edges,
                tetrahedra: answer.tetrahedra,
                per_tetrahedron: 2,
            },
            positions: answer
                .positions
                .iter()
                .map(|x| Vec3::from_array(x.map(number)))
                .collect(),
        })
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // The process may already have ended.
        if self.process.kill().is_ok() {
            let _ = self.process.wait();
        }
    }
}
