//! The stress tests: hard cases that test the stability of the solver.
//!
//! A [`Case`] is a piece of data: a family of [members](Member), the setup of a member's world, the
//! actions during the run, and a judge that reports the outcome as [figures](Figure). Each case is
//! run over its whole family, small bodies and large, from 10 µm to 1 km, rigid and
//! soft, with one substep and with many, and the worst member is reported. In every case, [`Watch`]
//! checks the universal requirements: all numbers are finite, no energy is created, pins do not
//! move, the momentum of free bodies is constant, and repeated runs with any number of threads give
//! the same bits.
//!
//! A case can be run in two ways: by [`run`](fn@run) for the program and the tests, and by
//! [`run_given`] for a user's body. [`scene::run`] makes a case of a user's scene.
//!
//! A member that is known to fail stays in the table and is listed in [`EXPECTED_FAILURES`].
//!
//! To add a case, add a `Case` in a file of `cases` and a line in [`CASES`].

mod advice;
mod case;
mod cases;
mod deformed;
mod energy;
mod error;
mod expected;
mod family;
mod figure;
pub mod filmstrip;
mod html;
mod in_app;
mod map;
mod member;
pub mod report;
mod run;
pub mod scene;
mod shape;
mod suite;
pub mod table;
mod tally;
mod watch;

pub use advice::{Advice, advise, advise_given};
pub use case::{Case, Outside, Start};
pub use cases::CASES;
pub use energy::Energy;
pub use error::TortureError;
pub use expected::{EXPECTED_FAILURES, ExpectedFailure};
pub use figure::Figure;
pub use member::Member;
pub use run::{Crews, Outcome, Run, prepared, run_given, run_member};
pub use shape::{Kind, Shape};
pub use suite::{Job, Options, SuiteRow, jobs, run};
pub use watch::{Moment, Watch};
