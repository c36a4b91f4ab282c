//! Results as a human-readable table and as JSON.

use super::{
    Case, Elastic, GrowthRow, Loading, Options, Roofline, Shape, Spread,
    cases::{EDGE_COMPLIANCE, SUBSTEPS},
    roofline::{Bound, Traffic},
    steps::Steps,
};
use serde_json::{Value, json};
use std::fmt::{self, Display, Formatter};

/// Particles per side of the cloth of about a thousand particles.
const SMALL: u32 = 32;

/// All figures.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Report {
    /// Options of the measurement.
    pub options: Options,
    /// Numbers of threads: 1, and all if there are several.
    pub threads: Vec<usize>,
    /// The instruction set that the solver used.
    pub instructions: &'static str,
    /// Hardware limits.
    pub roofline: Roofline,
    /// The cases.
    pub rows: Vec<BenchRow>,
    /// Blocks of a thousand to a million tetrahedra on a table, if requested.
    pub growth: Vec<GrowthRow>,
    /// Time to prepare a body of a million tetrahedra, if requested.
    pub loading: Option<Loading>,
}

/// The figures of a case.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct BenchRow {
    /// The benchmark case.
    pub case: Case,
    /// Particles of all bodies.
    pub particles: usize,
    /// Constraints of all bodies.
    pub constraints: usize,
    /// Working set of a substep of one body [byte].
    pub working_set: usize,
    /// Work of a projection.
    pub work: Traffic,
    /// Time of a projection if its particles were loaded one after the other, at the latency of the
    /// working set, and nothing else took time [ns]. This is not a bound: a good solver is far
    /// below it.
    pub loads_in_turn: f64,
    /// Whether the bodies stayed near their rest shapes.
    pub sound: bool,
    /// Results for each number of threads.
    pub stepped: Vec<Stepped>,
}

/// Speed with a number of threads.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Stepped {
    /// Number of threads.
    pub threads: usize,
    /// Time per projection [ns], all threads together: time of a tick over its projections.
    pub nanoseconds: Spread,
    /// Lower bounds from the hardware limits.
    pub bound: Bound,
}

impl Stepped {
    /// Million projections per second.
    #[must_use]
    pub fn millions(&self) -> Spread {
        self.nanoseconds.under(1e3)
    }

    /// Million projections per second at the roof.
    #[must_use]
    pub fn roof(&self) -> f64 {
        1e3 / self.bound.roof()
    }

    /// Fraction of the roof that is reached.
    #[must_use]
    pub fn fraction_of_bound(&self) -> f64 {
        self.bound.roof() / self.nanoseconds.median
    }
}

impl BenchRow {
    pub(super) fn new(steps: &Steps, figures: &[Spread], roofline: &Roofline) -> Self {
        let (case, working_set) = (steps.case, steps.working_set());
        let work = Traffic::new(steps.constraints(), working_set);
        let stepped = roofline.limits.iter().zip(figures);
        Self {
            case,
            particles: steps.topology.particles() * case.bodies,
            constraints: steps.projections() / SUBSTEPS as usize,
            working_set,
            work,
            loads_in_turn: roofline.in_turn(work.loads, working_set),
            sound: steps.sound(),
            stepped: stepped
                .map(|(limits, &nanoseconds)| Stepped {
                    threads: limits.threads,
                    nanoseconds,
                    // As many bodies are stepped at once as there are threads.
                    bound: limits.bound(&work, working_set * case.bodies.min(limits.threads)),
                })
                .collect(),
        }
    }
}

impl Report {
    /// Whether all bodies stayed near their rest shapes; otherwise figures are meaningless.
    #[must_use]
    pub fn sound(&self) -> bool {
        self.rows.iter().all(|row| row.sound) && self.growth.iter().all(|row| row.sound)
    }

    /// Time of a projection on one thread in the largest cloth relative to the cloth of a thousand
    /// particles, if both were measured.
    #[must_use]
    pub fn growth_of_cloth(&self) -> Option<f64> {
        let cloth = |row: &BenchRow| match row.case.shape {
            Shape::Cloth(side) if row.case.elastic == Elastic::Stretch => Some(side),
            _ => None,
        };
        let time = |row: &BenchRow| Some(row.stepped.first()?.nanoseconds.median);
        let small = self.rows.iter().find(|row| cloth(row) == Some(SMALL))?;
        let large = self.rows.iter().max_by_key(|row| cloth(row))?;
        (cloth(large)? > SMALL).then_some(time(large)? / time(small)?)
    }

    /// The object that `pliant bench --json` prints.
    #[must_use]
    pub fn json(&self) -> Value {
        json!({
            "version": env!("CARGO_PKG_VERSION"),
            "os": std::env::consts::OS,
            "architecture": std::env::consts::ARCH,
            "instructions": self.instructions,
            "threads": self.threads,
            "rounds": self.options.rounds,
            "slot_s": self.options.slot.as_secs_f64(),
            "substeps": SUBSTEPS,
            "edge_compliance_m_per_n": EDGE_COMPLIANCE,
            "sound": self.sound(),
            "growth": self.growth_of_cloth(),
            "blocks": self.growth.iter().map(block).collect::<Vec<_>>(),
            "loading": self.loading.map(|loading| json!({
                "tetrahedra": loading.tetrahedra,
                "edges": loading.edges,
                "seconds": loading.time.as_secs_f64(),
            })),
            "cases": self.rows.iter().map(row).collect::<Vec<_>>(),
            "roofline": roofline(&self.roofline),
        })
    }
}

fn spread(spread: &Spread) -> Value {
    json!({ "low": spread.low, "median": spread.median, "high": spread.high })
}

fn row(row: &BenchRow) -> Value {
    let stepped = |stepped: &Stepped| {
        json!({
            "threads": stepped.threads,
            "million_projections_per_s": spread(&stepped.millions()),
            "ns_per_projection": spread(&stepped.nanoseconds),
            "memory_bound_ns": stepped.bound.memory,
            "arithmetic_bound_ns": stepped.bound.arithmetic,
            "fraction_of_bound": stepped.fraction_of_bound(),
        })
    };
    json!({
        "name": row.case.name(),
        "bodies": row.case.bodies,
        "particles": row.particles,
        "constraints": row.constraints,
        "projections_per_tick": row.constraints * SUBSTEPS as usize,
        "working_set_bytes": row.working_set,
        "bytes_per_projection": row.work.bytes,
        "operations_per_projection": row.work.operations,
        "loads_in_turn_ns": row.loads_in_turn,
        "sound": row.sound,
        "stepped": row.stepped.iter().map(stepped).collect::<Vec<_>>(),
    })
}

fn block(row: &GrowthRow) -> Value {
    let stepped = row.stepped.iter().enumerate();
    json!({
        "tetrahedra": row.tetrahedra,
        "particles": row.particles,
        "projections_per_tick": row.projections,
        "contacts": row.contacts,
        "bytes": row.bytes,
        "sound": row.sound,
        "stepped": stepped.map(|(place, (threads, milliseconds))| json!({
            "threads": threads,
            "ms_per_tick": spread(milliseconds),
            "ns_per_projection": row.nanoseconds(place),
        })).collect::<Vec<_>>(),
    })
}

fn roofline(roofline: &Roofline) -> Value {
    let by_size = |figures: &[(usize, Spread)], name: &str| -> Vec<Value> {
        figures
            .iter()
            .map(|(bytes, figure)| json!({ "bytes": bytes, name: spread(figure) }))
            .collect()
    };
    json!({
        "latency": by_size(&roofline.latency, "ns"),
        "limits": roofline.limits.iter().map(|limits| json!({
            "threads": limits.threads,
            "bandwidth": by_size(&limits.bandwidth, "gb_per_s"),
            "operation_ns": spread(&limits.operation),
            "root_ns": spread(&limits.root),
            "quotient_ns": spread(&limits.quotient),
        })).collect::<Vec<_>>(),
    })
}

/// The table.
impl Display for Report {
    fn fmt(&self, out: &mut Formatter) -> fmt::Result {
        writeln!(
            out,
            "Million projections per second, {} instructions: median (lowest–highest) of {} rounds",
            self.instructions, self.options.rounds
        )?;
        writeln!(
            out,
            "\n{:<16} {:>9} {:>11} {:>8} {:>7} {:>16} {:>8} {:>8} {:>9} {:>9} {:>8}",
            "case",
            "particles",
            "constraints",
            "KiB",
            "threads",
            "M/s",
            "ns",
            "memory",
            "arithm.",
            "in turn",
            "of bound"
        )?;
        for row in &self.rows {
            self.row(out, row)?;
        }
        write!(out, "{LEGEND}")?;
        self.blocks(out)?;
        if let Some(growth) = self.growth_of_cloth() {
            writeln!(
                out,
                "\nOn one thread, a projection takes {growth:.2} times as long in the largest cloth as in \
                 one of a thousand particles."
            )?;
        }
        if let Some(loading) = &self.loading {
            writeln!(
                out,
                "\nNumbering, partitioning and coloring a body of {} tetrahedra and {} edges takes \
                 {:.2} s on one thread.",
                loading.tetrahedra,
                loading.edges,
                loading.time.as_secs_f64()
            )?;
        }
        self.machine(out)
    }
}

const LEGEND: &str = "
KiB      working set of a substep of one body: 12 bytes per edge, 24 per tetrahedron, 48 per particle
ns       time per projection: tick time / (edges + tetrahedra) / substeps
memory   lower bound by bandwidth: KiB / constraints / bandwidth at that size [ns]
arithm.  lower bound by arithmetic: operations, or square roots and divisions, in registers [ns]
in turn  time if each particle load waited for the previous one [ns]; not a bound
of bound the larger bound over ns: 100 % is the roofline
";

impl Report {
    fn row(&self, out: &mut Formatter, row: &BenchRow) -> fmt::Result {
        for (place, stepped) in row.stepped.iter().enumerate() {
            if place == 0 {
                let (name, size) = (row.case.name(), row.working_set.div_ceil(1024));
                write!(
                    out,
                    "{name:<16} {:>9} {:>11} {size:>8}",
                    row.particles, row.constraints
                )?;
            } else {
                write!(out, "{:47}", "")?;
            }
            let Spread { low, median, high } = stepped.millions();
            writeln!(
                out,
                " {:>7} {:>16} {:>8.2} {:>8.2} {:>9.2} {:>9.2} {:>6.0} %{}",
                stepped.threads,
                format!("{median:.0} ({low:.0}–{high:.0})"),
                stepped.nanoseconds.median,
                stepped.bound.memory,
                stepped.bound.arithmetic,
                row.loads_in_turn,
                stepped.fraction_of_bound() * 100.0,
                if row.sound { "" } else { "  diverged" },
            )?;
        }
        Ok(())
    }

    /// Blocks on a table.
    fn blocks(&self, out: &mut Formatter) -> fmt::Result {
        let Some(first) = self.growth.first() else {
            return Ok(());
        };
        writeln!(
            out,
            "\nA block on a table, with contact and gravity, {SUBSTEPS} substeps per tick\n\
             {:>10} {:>9} {:>8} {:>9} {:>11} {:>7} {:>22} {:>8} {:>8}",
            "tetrahedra",
            "particles",
            "contacts",
            "MiB",
            "bytes/tet",
            "threads",
            "ms per tick",
            "ns",
            "growth"
        )?;
        for row in &self.growth {
            for (place, (threads, Spread { low, median, high })) in row.stepped.iter().enumerate() {
                match place {
                    0 => write!(
                        out,
                        "{:>10} {:>9} {:>8} {:>9.1} {:>11}",
                        row.tetrahedra,
                        row.particles,
                        row.contacts,
                        row.bytes as f64 / (1 << 20) as f64,
                        row.bytes / row.tetrahedra,
                    )?,
                    _ => write!(out, "{:51}", "")?,
                }
                let per_projection = row.nanoseconds(place).unwrap_or(f64::NAN);
                let smallest = first.nanoseconds(place).unwrap_or(f64::NAN);
                writeln!(
                    out,
                    " {threads:>7} {:>22} {per_projection:>8.2} {:>7.2}×{}",
                    format!("{median:.3} ({low:.3}–{high:.3})"),
                    per_projection / smallest,
                    if row.sound { "" } else { "  diverged" },
                )?;
            }
        }
        writeln!(
            out,
            "\nns: time of a tick / (edges + tetrahedra) / substeps, contact included; growth: over that of the \
             smallest block"
        )
    }

    fn machine(&self, out: &mut Formatter) -> fmt::Result {
        let Roofline { limits, latency } = &self.roofline;
        writeln!(out, "\nThe machine, best of {} rounds", self.options.rounds)?;
        write!(out, "{:>10}", "array KiB")?;
        for limits in limits {
            write!(out, " {:>18}", on(limits.threads, "GB/s"))?;
        }
        writeln!(out, " {:>16}", "ns/random load")?;
        for (place, (bytes, load)) in latency.iter().enumerate() {
            write!(out, "{:>10}", bytes / 1024)?;
            for limits in limits {
                write!(out, " {:>18.1}", limits.bandwidth[place].1.high)?;
            }
            writeln!(out, " {:>16.1}", load.low)?;
        }
        for limits in limits {
            writeln!(
                out,
                "{}: {:.4} per addition or multiplication, {:.3} per square root, {:.3} per division",
                on(limits.threads, "ns"),
                limits.operation.low,
                limits.root.low,
                limits.quotient.low,
            )?;
        }
        Ok(())
    }
}

fn on(threads: usize, unit: &str) -> String {
    match threads {
        1 => format!("{unit}, 1 thread"),
        _ => format!("{unit}, {threads} threads"),
    }
}
