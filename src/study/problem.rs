//! The problem file: a scene, its refinement, the observed quantity, and the reference for it.

use super::{
    StudyError,
    closed_form::Reference,
    hash,
    observe::{Conserved, Observe, Select},
    record::ProblemText,
    registry,
    setting::constraints,
    state::{Solver, State},
};
use crate::{
    scene::{BodySpec, Scene, parse},
    solver::{Body, RodLink, World},
};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A problem.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Problem {
    /// Its name in commands: the name of its file; not in the file.
    #[serde(skip)]
    pub name: String,
    /// The text of its file; not in the file.
    #[serde(skip)]
    pub text: String,
    /// Hash of that text; not in the file.
    #[serde(skip)]
    pub hash: String,
    /// Its title.
    pub title: String,
    /// Its subject, and the meaning of its result.
    pub about: String,
    /// The scene, in the format of scene files. Its acceptance is not evaluated.
    pub scene: Scene,
    /// Meshes from coarse to fine; none for the scene as it is.
    #[serde(default)]
    pub levels: Vec<Level>,
    /// The observed quantity.
    pub observe: Observe,
    /// The reference that it is compared with.
    pub reference: Reference,
    /// Normalization of the error, in the unit of the observed quantity; none for the converged
    /// solution itself, the size of the body for a path, and the initial value of a conserved
    /// quantity.
    #[serde(default)]
    pub percent_of: Option<f64>,
    /// Settings of the f64 reference.
    #[serde(default, alias = "twin")]
    pub converged: ReferenceSettings,
}

/// A mesh.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Level {
    /// Its name, such as `4 cells`.
    pub name: String,
    /// The bodies of the scene on this mesh, including parameters that depend on the mesh, such as
    /// the compliance per spring.
    pub bodies: Vec<BodySpec>,
}

/// Settings of the f64 reference, for observations other than a [static
/// equilibrium](super::converge). It is run with these settings and with twice as many substeps;
/// for motion, also with four times as many.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ReferenceSettings {
    /// Substeps per tick of the first run, from 1 to 2500; 128 by default.
    pub substeps: u32,
    /// Iterations per substep, from 1; 1 by default.
    pub iterations: u32,
    /// Whether multipliers are kept from substep to substep in the search for rest; true by
    /// default. With rigid constraints this can diverge in growing oscillations; multipliers must
    /// then be reset, and rest is extrapolated from h, h/2 and h/4 like motion.
    pub keeps_multipliers: bool,
}

impl Default for ReferenceSettings {
    fn default() -> Self {
        Self {
            substeps: 128,
            iterations: 1,
            keeps_multipliers: true,
        }
    }
}

/// A problem on one mesh, ready to run.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Case {
    /// The problem.
    pub problem: Problem,
    /// Index of the mesh, from 0.
    pub level: usize,
    /// Name of the mesh.
    pub level_name: String,
    /// Number of meshes of the problem.
    pub levels: usize,
    /// Its world, in the initial state.
    pub world: World,
    /// The initial state in f64.
    pub start: State,
}

impl Problem {
    /// A built-in problem by its name, or a file by its path.
    ///
    /// # Errors
    /// [`StudyError`] with the requested name, or with file, line and column.
    pub fn load(name: &str) -> Result<Self, StudyError> {
        if let Some(builtin) = registry::find(name) {
            return Self::parse(name, &format!("{name}.ron"), builtin.text);
        }
        let path = Path::new(name);
        let text = std::fs::read_to_string(path).map_err(|error| {
            let looks_like_a_path = name.contains(['/', '\\', '.']);
            if error.kind() == std::io::ErrorKind::NotFound && !looks_like_a_path {
                StudyError::Unknown {
                    name: name.to_owned(),
                    valid: registry::names(),
                }
            } else {
                StudyError::Unreadable {
                    path: path.to_owned(),
                    error,
                }
            }
        })?;
        let stem = path.file_stem().map(|stem| stem.to_string_lossy());
        let mut problem = Self::parse(&stem.unwrap_or_default(), name, &text)?;
        problem.scene.folder = path.parent().map(Into::into).unwrap_or_default();
        Ok(problem)
    }

    /// Parses the text of a problem file; `file` is its name in error messages.
    ///
    /// # Errors
    /// [`StudyError::Scene`] with line and column, [`StudyError::Problem`] for inconsistencies.
    pub fn parse(name: &str, file: &str, text: &str) -> Result<Self, StudyError> {
        let mut problem: Self = parse(file, text)?;
        name.clone_into(&mut problem.name);
        text.clone_into(&mut problem.text);
        problem.hash = hash::of(text);
        problem.check()?;
        Ok(problem)
    }

    /// Its text with everything that is needed to parse it again.
    pub(super) fn to_record(&self) -> ProblemText {
        ProblemText {
            name: self.name.clone(),
            text: self.text.clone(),
            folder: self.scene.folder.to_string_lossy().into_owned(),
        }
    }

    pub(super) fn from_record(record: &ProblemText) -> Result<Self, StudyError> {
        let mut problem = Self::parse(&record.name, &record.name, &record.text)?;
        problem.scene.folder = Path::new(&record.folder).to_owned();
        Ok(problem)
    }

    /// One case for each mesh.
    ///
    /// # Errors
    /// [`StudyError`] for a scene that cannot be built, or an observation of something that it does
    /// not contain.
    pub fn cases(&self) -> Result<Vec<Case>, StudyError> {
        let count = self.levels.len().max(1);
        (0..count).map(|level| self.case(level, count)).collect()
    }

    fn case(&self, level: usize, levels: usize) -> Result<Case, StudyError> {
        let mut scene = self.scene.clone();
        let mut level_name = "as it is".to_owned();
        if let Some(level) = self.levels.get(level) {
            scene.bodies.clone_from(&level.bodies);
            level_name.clone_from(&level.name);
        }
        let own = scene
            .bodies
            .iter()
            .find(|body| !body.effects.own.is_empty());
        if let Some(body) = own {
            let names: Vec<_> = body.effects.own.iter().map(|it| it.name()).collect();
            let message = format!(
                "{} carries {}, which the f64 reference does not know, as it is an effect of an app; \
                 `study::refine` compares such a scene with its finest run",
                body.name,
                names.join(", ")
            );
            return Err(self.wrong(message));
        }
        let mut world = scene.build()?.world;
        world.sleep.enabled = false;
        let start = Solver::reference(&world).state();
        let case = Case {
            problem: self.clone(),
            level,
            level_name,
            levels,
            world,
            start,
        };
        case.check()?;
        Ok(case)
    }

    fn wrong(&self, message: impl Into<String>) -> StudyError {
        StudyError::Problem {
            problem: self.name.clone(),
            message: message.into(),
        }
    }

    fn check(&self) -> Result<(), StudyError> {
        let seconds = self.observe.seconds();
        if !(seconds > 0.0 && seconds <= 1000.0) {
            let message =
                format!("the observed time is {seconds} s, but must be above 0 and at most 1000 s");
            return Err(self.wrong(message));
        }
        if let Observe::Path { times } = &self.observe
            && !times.is_sorted()
        {
            return Err(self.wrong("the times of a path must be ascending"));
        }
        if let Observe::Period { periods: 0, .. } = self.observe {
            return Err(self.wrong("a mean needs at least one period"));
        }
        if let Observe::Torn { splits: 0, .. } = self.observe {
            return Err(self.wrong("a tear has at least one split"));
        }
        if self
            .percent_of
            .is_some_and(|of| !(of > 0.0 && of.is_finite()))
        {
            return Err(self.wrong("percent_of must be a number above 0"));
        }
        if let Some(value) = self.reference.value()
            && !value.is_finite()
        {
            let message = format!(
                "its closed form is {value}, but must be finite; check the parameters of its reference"
            );
            return Err(self.wrong(message));
        }
        let ReferenceSettings {
            substeps,
            iterations,
            ..
        } = self.converged;
        if !(1..=2500).contains(&substeps) || !(1..=10_000).contains(&iterations) {
            let message = "the reference takes 1 to 2500 substeps, which are then doubled twice, and 1 to 10 000 iterations";
            return Err(self.wrong(message));
        }
        Ok(())
    }
}

impl Case {
    /// Its name in commands: the name of the problem, and the number of the mesh from 1.
    #[must_use]
    pub fn id(&self) -> String {
        format!("{}@{}", self.problem.name, self.level + 1)
    }

    /// Particles of all bodies.
    #[must_use]
    pub fn particles(&self) -> usize {
        self.start.bodies.iter().map(|body| body.x.len()).sum()
    }

    /// Constraints of all bodies.
    #[must_use]
    pub fn constraints(&self) -> usize {
        constraints(&self.world)
    }

    fn check(&self) -> Result<(), StudyError> {
        let bodies = self.start.bodies.len();
        if let Observe::Drift {
            of: Conserved::Link,
            ..
        } = self.problem.observe
        {
            let is_ring = |body: &Body| {
                let at: Vec<_> = body.topology.rest.iter().map(|x| x.as_dvec3()).collect();
                let has_link = body.effects.rod.is_some() && body.effects.tear.is_none();
                has_link && RodLink::of(&body.topology, &at, &[]).is_some()
            };
            if !self.world.bodies.iter().any(is_ring) {
                let message = format!(
                    "on the mesh “{}”: `Link` needs one closed ring with `rod` and without `tear`, such as the \
                     primitive `Hoop`",
                    self.level_name
                );
                return Err(self.problem.wrong(message));
            }
        }
        let (body, select) = match &self.problem.observe {
            Observe::Rest { quantity, .. } | Observe::At { quantity, .. } => {
                let (body, select) = quantity.subject();
                (body, select.cloned())
            }
            Observe::Period { body, particle, .. } => (*body, Some(Select::Particle(*particle))),
            Observe::Torn { body, .. } => (*body, None),
            _ => (0, None),
        };
        if body >= bodies {
            let message = format!(
                "it observes body {body}, but the number of bodies is {bodies}, counted from 0"
            );
            return Err(self.problem.wrong(message));
        }
        if select.is_some_and(|select| select.particles(&self.start, &self.world, body).is_empty())
        {
            let message = format!(
                "on the mesh “{}”, the observed region of body {body} contains no particle",
                self.level_name
            );
            return Err(self.problem.wrong(message));
        }
        Ok(())
    }
}
