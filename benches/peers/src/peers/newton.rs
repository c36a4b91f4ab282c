//! Newton, in a separate Python process; see also `newton.py`.
//!
//! The protocol is one line per message: a scene as JSON, then `tick` and `report`. The measured
//! time of a tick includes that of its message, some tens of microseconds.

use crate::{
    peer::{Counts, Peer, PeerError, Report, Run},
    process::Process,
    scenes::{GRAVITY, RATE, SUBSTEPS, Scene},
};
use glam::Vec3;
use serde::Deserialize;
use std::{
    path::{Path, PathBuf},
    process::Command,
    time::Duration,
};

const SCRIPT: &str = include_str!("newton.py");

/// Why Newton is left out without a Python.
///
/// # Errors
/// [`PeerError::Missing`] in any case.
pub fn not_asked_for() -> Result<Box<dyn Peer>, PeerError> {
    Err(PeerError::Missing(
        "`--newton PYTHON` names a Python that has it (`pip install newton`)".into(),
    ))
}

/// Newton, if it is installed for this Python.
///
/// # Errors
/// [`PeerError::Missing`] if it cannot be imported.
pub fn find(python: &Path) -> Result<Box<dyn Peer>, PeerError> {
    // What Warp prints goes to the standard error.
    let script = "import sys; answers = sys.stdout; sys.stdout = sys.stderr; import newton; \
                  print(newton.__version__, file=answers)";
    let version = Process::start(Command::new(python).args(["-c", script]))
        .and_then(|mut process| process.ask("", LIMIT))
        .map_err(|error| {
            let python = python.display();
            PeerError::Missing(format!(
                "{python} cannot import it ({error}); install it with `{python} -m pip install newton`"
            ))
        })?;
    Ok(Box::new(Newton {
        python: python.into(),
        version,
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
         twenty-four to a particle need to stay stable; a tetrahedron is two constraints, shape and volume, and counts as two. The \
         substeps of a tick are recorded as a graph (`ScopedCapture`). One thread."
    }

    fn is_parallel(&self) -> bool {
        false
    }

    fn build(&self, scene: &Scene, _threads: usize) -> Result<Box<dyn Run>, PeerError> {
        let process = Process::start(Command::new(&self.python).args(["-c", SCRIPT]))?;
        let mut running = Running(process);
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

/// The longest time of an answer: Warp compiles its kernels when they are first used.
const LIMIT: Duration = Duration::from_secs(900);

struct Running(Process);

#[derive(Deserialize)]
struct Answer {
    edges: u64,
    tetrahedra: u64,
    /// Three numbers per particle; `null` if not finite.
    positions: Vec<[Option<f32>; 3]>,
}

impl Running {
    fn ask(&mut self, line: &str) -> Result<String, PeerError> {
        self.0.ask(line, LIMIT)
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
