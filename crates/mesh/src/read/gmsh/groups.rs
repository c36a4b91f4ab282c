//! Physical groups of a Gmsh file: their names, and the elements that belong to them.
//!
//! In format 2 an element gives the number of its group. In format 4 it belongs to an entity, and
//! `$Entities` gives the groups of each. Groups are numbered in each dimension by itself.

use std::{cmp::Reverse, collections::BTreeMap, ops::Range, sync::Arc};

use super::{
    super::parts::{Counts, Label, Named, Part},
    end_of_section,
    source::{Source, Width},
};
use crate::MeshError;

#[derive(Default)]
pub struct Groups {
    /// By dimension and number.
    names: BTreeMap<(i64, u64), Arc<str>>,
    /// By dimension, that of volumes first, and number. In format 2, each group is one.
    entities: BTreeMap<(Reverse<i64>, u64), Entity>,
    /// The first error in the sections that only groups need.
    problem: Option<MeshError>,
}

#[derive(Default)]
struct Entity {
    groups: Vec<u64>,
    /// Runs of consecutive elements.
    elements: Vec<Range<Counts>>,
}

impl Groups {
    /// Reads `$PhysicalNames`, text in binary files too.
    pub fn names(&mut self, source: &mut Source) -> Result<(), MeshError> {
        const END: &str = "$EndPhysicalNames";
        self.section(source, END, |groups, source| {
            for _ in 0..source.written("the number of physical groups")? {
                let dimension = source.written_int("the dimension of a physical group")?;
                let number = source.written_int("the number of a physical group")?;
                let name = source.quoted("the name of a physical group in quotation marks")?;
                if !name.is_empty() {
                    let group = (dimension, number.unsigned_abs());
                    groups.names.insert(group, (&*name).into());
                }
            }
            end_of_section(source, END)
        })
    }

    /// Reads `$Entities` of format 4. A point has a box there, as other entities have, or, in format
    /// 4.1, only a position.
    pub fn entities(
        &mut self,
        source: &mut Source,
        points_in_boxes: bool,
    ) -> Result<(), MeshError> {
        const END: &str = "$EndEntities";
        self.section(source, END, |groups, source| {
            let mut counts = [0; 4];
            for count in &mut counts {
                *count = source.whole(Width::Size, "the number of entities of a dimension")?;
            }
            for (dimension, count) in (0..).zip(counts) {
                for _ in 0..count {
                    let number = source.int("the number of an entity")?;
                    let is_position = dimension == 0 && !points_in_boxes;
                    source.skip_reals(if is_position { 3 } else { 6 }, "the box of an entity")?;
                    let mut of_entity = Vec::new();
                    for _ in 0..source.whole(Width::Size, "the number of physical groups")? {
                        let group = source.int("the number of a physical group")?;
                        // A negative number reverses the elements.
                        of_entity.push(group.unsigned_abs());
                    }
                    if dimension > 0 {
                        for _ in 0..source.whole(Width::Size, "the number of entities around it")? {
                            source.int("the number of an entity around it")?;
                        }
                    }
                    if !of_entity.is_empty() {
                        groups.entity(dimension, number).groups = of_entity;
                    }
                }
            }
            end_of_section(source, END)
        })
    }

    /// Passes `$PartitionedEntities`, to which the elements of a mesh with partitions belong.
    pub fn partitioned(&mut self, source: &mut Source) -> Result<(), MeshError> {
        if self.problem.is_none() {
            let expected = "a mesh without partitions, as Gmsh saves it after “Unpartition”";
            self.problem = Some(source.wrong(expected));
        }
        source.pass("$EndPartitionedEntities")
    }

    /// Reads a section. If it is damaged, it is passed, as the mesh does not need it; those after it
    /// are passed at once, so that the file is read through for one of them only.
    fn section(
        &mut self,
        source: &mut Source,
        end: &str,
        read: impl FnOnce(&mut Self, &mut Source) -> Result<(), MeshError>,
    ) -> Result<(), MeshError> {
        if self.problem.is_none() {
            let start = source.clone();
            let Err(error) = read(self, source) else {
                return Ok(());
            };
            self.problem = Some(error);
            *source = start;
        }
        source.pass(end)
    }

    /// Adds elements of an entity of format 4.
    pub fn add_to_entity(&mut self, dimension: i64, number: i64, elements: Range<Counts>) {
        if elements.is_empty() {
            return;
        }
        let runs = &mut self.entity(dimension, number).elements;
        match runs.last_mut() {
            Some(last) if last.end == elements.start => last.end = elements.end,
            _ => runs.push(elements),
        }
    }

    /// Adds elements of a physical group of format 2.
    pub fn add_to_group(&mut self, dimension: i64, group: i64, elements: Range<Counts>) {
        let groups = &mut self.entity(dimension, group).groups;
        if groups.is_empty() {
            groups.push(group.unsigned_abs());
        }
        self.add_to_entity(dimension, group, elements);
    }

    fn entity(&mut self, dimension: i64, number: i64) -> &mut Entity {
        let key = (Reverse(dimension), number.unsigned_abs());
        self.entities.entry(key).or_default()
    }

    /// The groups as parts of a file.
    pub fn named(self, notes: Vec<String>, ignored: &'static str) -> Named {
        let mut named = Named {
            notes,
            ignored,
            ..Named::default()
        };
        if let Some(problem) = self.problem {
            named.problem = Some(format!("the physical groups cannot be read: {problem}"));
            return named;
        }
        for ((Reverse(dimension), _), entity) in self.entities {
            let (mut names, mut numbers) = (Vec::new(), Vec::new());
            for group in entity.groups {
                match self.names.get(&(dimension, group)) {
                    Some(name) => names.push(name.clone()),
                    None => numbers.push(group.to_string().into()),
                }
            }
            named.parts.push(Part {
                label: Label::Physical { names, numbers },
                elements: entity.elements,
            });
        }
        // Without elements, a group is known all the same.
        named
            .parts
            .extend(self.names.into_values().map(|name| Part {
                label: Label::Physical {
                    names: vec![name],
                    numbers: Vec::new(),
                },
                elements: Vec::new(),
            }));
        named
    }
}
