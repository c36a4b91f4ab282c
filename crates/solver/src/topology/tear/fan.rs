//! The elements around each particle.

use std::collections::BTreeMap;

/// Elements around each particle, in ascending order.
#[derive(Debug)]
pub(super) struct Fans {
    /// Start of the elements of each particle, and the end of those of the last.
    starts: Vec<u32>,
    elements: Vec<u32>,
    /// Those that have changed, and those of copies.
    changed: BTreeMap<u32, Vec<u32>>,
}

impl Fans {
    pub fn of<const N: usize>(corners: &[[u32; N]], particles: usize) -> Self {
        let mut starts = vec![0_u32; particles + 1];
        for &corner in corners.as_flattened() {
            starts[corner as usize + 1] += 1;
        }
        for i in 0..particles {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut elements = vec![0; corners.len() * N];
        for (element, corners) in (0..).zip(corners) {
            for &corner in corners {
                let slot = &mut next[corner as usize];
                elements[*slot as usize] = element;
                *slot += 1;
            }
        }
        Self {
            starts,
            elements,
            changed: BTreeMap::new(),
        }
    }

    pub fn of_particle(&self, particle: u32) -> &[u32] {
        if let Some(changed) = self.changed.get(&particle) {
            return changed;
        }
        let particle = particle as usize;
        &self.elements[self.starts[particle] as usize..self.starts[particle + 1] as usize]
    }

    /// Gives some of the elements of a particle to a copy.
    pub fn give(&mut self, particle: u32, elements: &[u32], copy: u32) {
        let mut kept = self.of_particle(particle).to_vec();
        kept.retain(|element| !elements.contains(element));
        self.changed.insert(particle, kept);
        self.changed.insert(copy, elements.to_vec());
    }
}
