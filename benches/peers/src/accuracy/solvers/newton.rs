//! Newton's XPBD and VBD, in one Python process for all trials; see also `newton.py`.
//!
//! The process measures the processor time of its ticks itself. Messages cost nothing therefore,
//! and rest is found as for all peers, tick by tick.
//!
//! VBD's neo-Hookean energy is that of Pliant, and with µ = 0 it is the energy of a bulk modulus λ. So is
//! one of the two constraints of a tetrahedron in XPBD. The other one has an energy of
//! ½µ(tr FᵀF − 3)², which does not resist small shear: no µ makes it a neo-Hookean one.

use super::{Setting, Solver, Trial, grid};
use crate::{
    accuracy::{
        body::{inverse_masses, refused, shortest_edge},
        problems::{Elasticity, Problem, Volumes},
    },
    peer::{Counts, PeerError},
    process::Process,
    scenes::GRAVITY,
};
use glam::DVec3;
use serde_json::json;
use std::{
    cell::RefCell,
    path::{Path, PathBuf},
    process::Command,
    rc::Rc,
    time::Duration,
};

const SCRIPT: &str = include_str!("newton.py");

/// A first build compiles Warp's kernels.
const BUILD: Duration = Duration::from_secs(900);

/// Other answers take up to a round of timing.
const ANSWER: Duration = Duration::from_secs(120);

/// Relaxation factors of tetrahedra that are tried in XPBD; 0.9 is the default.
const RELAXATIONS: [f32; 3] = [0.9, 0.3, 0.1];

/// Bulk moduli of rigid volumes that are tried in VBD, relative to 1/(αL) with the compliance α and
/// the length L of the shortest edge.
const BULK: [f32; 3] = [1.0, 4.0, 16.0];

/// Second Lamé parameter of rigid volumes in XPBD [Pa]: no compliance in single precision.
const RIGID: f32 = 1e20;

/// First Lamé parameter in XPBD where it is to have no effect [Pa]; tetrahedra with zero are left out.
const NONE: f32 = 1e-12;

/// Method of Newton.
#[derive(Clone, Copy, PartialEq)]
enum Method {
    /// Jacobi iterations over the constraints.
    Xpbd,
    /// Vertex block descent: Gauss–Seidel iterations over the particles.
    Vbd,
}

/// Solver of Newton.
pub struct Newton {
    method: Method,
    python: PathBuf,
    /// The process, once it is needed.
    process: Rc<RefCell<Option<Shared>>>,
}

type Shared = Rc<RefCell<Process>>;

impl Newton {
    /// Both solvers, with this Python.
    #[must_use]
    pub fn all(python: &Path) -> [Self; 2] {
        let process = Rc::new(RefCell::new(None));
        [Method::Xpbd, Method::Vbd].map(|method| Self {
            method,
            python: python.into(),
            process: Rc::clone(&process),
        })
    }

    /// The running process, which is started if there is none, or if it has failed.
    fn process(&self) -> Result<Shared, PeerError> {
        let mut current = self.process.borrow_mut();
        if let Some(process) = current.as_ref().filter(|it| !it.borrow().has_failed()) {
            return Ok(Rc::clone(process));
        }
        let process = Process::start(Command::new(&self.python).args(["-c", SCRIPT]))?;
        let process = Rc::new(RefCell::new(process));
        *current = Some(Rc::clone(&process));
        Ok(process)
    }

    /// The problem with a setting, as the script takes it.
    fn description(&self, problem: &Problem, setting: Setting) -> Result<String, PeerError> {
        let shape = &problem.shape;
        let mut edges = &shape.edges[..];
        let mut tetrahedra = &shape.tetrahedra[..];
        let mut stiffness = 0.0;
        let [mu, lambda];
        match problem.elasticity {
            Elasticity::Springs {
                compliance,
                volumes,
            } => {
                stiffness = 1.0 / compliance;
                mu = match self.method {
                    Method::Xpbd => NONE,
                    Method::Vbd => 0.0,
                };
                lambda = match volumes {
                    Volumes::Free => 0.0,
                    Volumes::Bulk(modulus) => modulus,
                    Volumes::Rigid => setting.bulk.unwrap_or(RIGID),
                };
                if volumes == Volumes::Free {
                    tetrahedra = &[];
                }
            }
            Elasticity::NeoHookean {
                youngs_modulus,
                poisson_ratio,
            } => {
                edges = &[];
                mu = youngs_modulus / (2.0 * (1.0 + poisson_ratio));
                lambda = 2.0 * mu * poisson_ratio / (1.0 - 2.0 * poisson_ratio);
            }
        }
        let description = json!({
            "solver": match self.method {
                Method::Xpbd => "xpbd",
                Method::Vbd => "vbd",
            },
            "substeps": setting.substeps,
            "iterations": setting.iterations,
            "relaxation": setting.relaxation.unwrap_or(RELAXATIONS[0]),
            "vertices": shape.vertices,
            "inverse_masses": inverse_masses(problem)?,
            "edges": edges,
            "edge_stiffness": stiffness,
            "tetrahedra": tetrahedra,
            "k_mu": mu,
            "k_lambda": lambda,
            "gravity": GRAVITY,
        });
        Ok(description.to_string())
    }
}

impl Solver for Newton {
    fn name(&self) -> &'static str {
        match self.method {
            Method::Xpbd => "Newton XPBD",
            Method::Vbd => "Newton VBD",
        }
    }

    fn peer(&self) -> &'static str {
        "Newton"
    }

    fn setup(&self) -> &'static str {
        match self.method {
            Method::Xpbd => {
                "`SolverXPBD` on the CPU with 1 to 1024 steps (here called substeps) of 1 to 64 \
                 iterations, recorded as a graph (`ScopedCapture`); relaxation ω of tetrahedra of 0.9, \
                 its default, 0.3 or 0.1."
            }
            Method::Vbd => {
                "`SolverVBD` on the CPU with the same steps and iterations, recorded as a graph; \
                 colors of a greedy coloring with springs, which its own omits; rigid volumes with a bulk \
                 modulus K of 1, 4 or 16 times 1/(αL), of the compliance α and the length L of the \
                 shortest edge."
            }
        }
    }

    fn refusal(&self, problem: &Problem) -> Option<&'static str> {
        match (self.method, problem.elasticity) {
            (Method::Xpbd, Elasticity::NeoHookean { .. }) => {
                Some("its tetrahedra do not resist small shear")
            }
            _ => None,
        }
    }

    fn settings(&self, problem: &Problem) -> Vec<Setting> {
        let all = grid(
            &[1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024],
            &[1, 2, 4, 16, 64],
            4096,
        );
        let Elasticity::Springs {
            compliance,
            volumes,
        } = problem.elasticity
        else {
            return all;
        };
        let with = |change: &dyn Fn(Setting) -> Setting| -> Vec<Setting> {
            all.iter().map(|&setting| change(setting)).collect()
        };
        match (self.method, volumes) {
            (_, Volumes::Free) | (Method::Vbd, Volumes::Bulk(_)) => all,
            (Method::Xpbd, _) => {
                let relaxed = RELAXATIONS.iter().flat_map(|&factor| {
                    with(&|setting| Setting {
                        relaxation: Some(factor),
                        ..setting
                    })
                });
                relaxed.collect()
            }
            (Method::Vbd, Volumes::Rigid) => {
                let unit = 1.0 / (compliance * shortest_edge(problem));
                let stiff = BULK.iter().flat_map(|&factor| {
                    with(&|setting| Setting {
                        bulk: Some(factor * unit),
                        ..setting
                    })
                });
                stiff.collect()
            }
        }
    }

    fn build(&self, problem: &Problem, setting: Setting) -> Result<Box<dyn Trial>, PeerError> {
        if let Some(reason) = self.refusal(problem) {
            return Err(refused(problem, &reason));
        }
        let message = format!("build {}", self.description(problem, setting)?);
        let process = self.process()?;
        let answer = process.borrow_mut().ask(&message, BUILD)?;
        let (number, counts, positions) = parse_built(&answer, problem)?;
        Ok(Box::new(Running {
            process,
            number,
            counts,
            positions,
            failure: None,
        }))
    }
}

/// The words of an answer after `ok`.
fn words(answer: &str) -> Result<std::str::SplitWhitespace<'_>, PeerError> {
    match answer.split_once(' ') {
        Some(("ok", rest)) => Ok(rest.split_whitespace()),
        _ => Err(PeerError::Process(answer.to_owned())),
    }
}

fn unexpected() -> PeerError {
    PeerError::Process("an answer of another form than that of newton.py".into())
}

/// Number of a model, its constraints and its positions.
fn parse_built(answer: &str, problem: &Problem) -> Result<(u64, Counts, Vec<DVec3>), PeerError> {
    // An error of Newton is one of this setting; the process goes on.
    if let Some(reason) = answer.strip_prefix("error ") {
        return Err(refused(problem, &reason));
    }
    let mut words = words(answer)?;
    let mut number = || words.next()?.parse().ok();
    let counts = (number(), number(), number());
    let (Some(number), Some(edges), Some(tetrahedra)) = counts else {
        return Err(unexpected());
    };
    let positions = words.next().and_then(decoded).ok_or_else(unexpected)?;
    let counts = Counts {
        edges,
        tetrahedra,
        per_tetrahedron: 1,
    };
    Ok((number, counts, positions))
}

/// Positions in hexadecimal numbers, three of single precision each.
fn decoded(text: &str) -> Option<Vec<DVec3>> {
    let bytes: Option<Vec<u8>> = (0..text.len() / 2)
        .map(|i| u8::from_str_radix(text.get(2 * i..2 * i + 2)?, 16).ok())
        .collect();
    let bytes = bytes?;
    let number = |bytes: &[u8]| f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
    let points = bytes.chunks_exact(12);
    let point = |x: &[u8]| {
        DVec3::new(
            number(&x[..4]).into(),
            number(&x[4..8]).into(),
            number(&x[8..]).into(),
        )
    };
    points
        .remainder()
        .is_empty()
        .then(|| points.map(point).collect())
}

/// The inverse of [`decoded`].
fn encoded(positions: &[DVec3]) -> String {
    use std::fmt::Write;
    let mut text = String::with_capacity(24 * positions.len());
    for number in positions.iter().flat_map(|x| x.as_vec3().to_array()) {
        for byte in number.to_le_bytes() {
            // Writing to a string does not fail.
            let _ = write!(text, "{byte:02x}");
        }
    }
    text
}

struct Running {
    process: Shared,
    number: u64,
    counts: Counts,
    positions: Vec<DVec3>,
    failure: Option<String>,
}

impl Running {
    /// Asks for positions, and for a time [s] before them.
    fn ask(&mut self, message: &str, timed: bool) -> Result<f64, PeerError> {
        let answer = self.process.borrow_mut().ask(message, ANSWER)?;
        let mut words = words(&answer)?;
        let seconds = match timed {
            true => words.next().and_then(|word| word.parse().ok()),
            false => Some(0.0),
        };
        let positions = words.next().and_then(decoded);
        let (Some(seconds), Some(positions)) = (seconds, positions) else {
            return Err(unexpected());
        };
        self.positions = positions;
        Ok(seconds)
    }

    /// The same; after a failure it does nothing.
    fn try_ask(&mut self, message: &str, timed: bool) -> f64 {
        if self.failure.is_some() {
            return 0.0;
        }
        match self.ask(message, timed) {
            Ok(seconds) => seconds,
            Err(error) => {
                self.failure = Some(error.to_string());
                0.0
            }
        }
    }
}

impl Trial for Running {
    fn tick(&mut self) {
        self.advance(1);
    }

    fn advance(&mut self, ticks: u32) -> Duration {
        let message = format!("advance {} {ticks}", self.number);
        Duration::try_from_secs_f64(self.try_ask(&message, true)).unwrap_or_default()
    }

    fn positions(&mut self, positions: &mut Vec<DVec3>) {
        positions.clone_from(&self.positions);
    }

    fn place(&mut self, positions: &[DVec3]) {
        let message = format!("place {} {}", self.number, encoded(positions));
        self.try_ask(&message, false);
    }

    fn counts(&self) -> Counts {
        self.counts
    }

    fn failure(&self) -> Option<&str> {
        self.failure.as_deref()
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let message = format!("drop {}", self.number);
        // If it fails, the model stays until the process ends.
        let _ = self.process.borrow_mut().ask(&message, ANSWER);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_survive_the_way_there_and_back() {
        let positions = [DVec3::new(0.5, -1.25, 3e-8_f32.into()), DVec3::NEG_ONE];
        assert_eq!(decoded(&encoded(&positions)), Some(positions.to_vec()));
        let diverged = decoded(&encoded(&[DVec3::NAN])).expect("it is a position");
        assert!(diverged[0].is_nan());
        assert_eq!(decoded("00ff"), None);
        assert_eq!(decoded("zz"), None);
    }

    /// A Python that is not there is an error that names it.
    #[test]
    fn a_missing_python_is_an_error() {
        let problem = crate::accuracy::problems::build("chain").expect("it is a problem");
        let [xpbd, _] = Newton::all(Path::new("/nowhere/python3"));
        let error = xpbd.build(&problem, Setting::new(1, 1)).err();
        let error = error.expect("there is no such program").to_string();
        assert!(error.contains("/nowhere/python3"), "{error}");
    }
}
