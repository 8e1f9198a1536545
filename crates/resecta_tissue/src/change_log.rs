//! Which slots of a fine surface cuts have changed, for those that keep something a triangle: they read on from where they
//! stopped instead of looking at a hundred thousand triangles after each cut.

use resecta_field::Changes;

/// Entries that are kept. Beyond, the older half is dropped, and a reader that has not seen it reads the whole surface, which takes 50 ms
/// late in an operation. The younger half holds some seconds of strokes, so that a reader of every step or frame never comes to that.
const MOST: usize = 1 << 16;

/// The changes of the last cuts, each with the version of the surface that it led to, rising.
#[derive(Default)]
pub(crate) struct ChangeLog {
    triangles: Vec<(u64, u32)>,
    chunks: Vec<(u64, u32)>,
    nodes: Vec<(u64, u32)>,
    /// The version before the first change that is kept, and after the last.
    from: u64,
    to: u64,
}

/// What changed since a version. A slot may be in a list more than once.
pub(crate) struct ChangesSince<'a> {
    triangles: &'a [(u64, u32)],
    chunks: &'a [(u64, u32)],
    nodes: &'a [(u64, u32)],
}

impl ChangesSince<'_> {
    /// Slots of triangles that came, went or were replaced.
    pub fn triangles(&self) -> impl Iterator<Item = u32> {
        self.triangles.iter().map(|(_, slot)| *slot)
    }

    /// Chunks of which a vertex came, went, was put elsewhere in its pentahedron or is of another kind.
    pub fn chunks(&self) -> impl Iterator<Item = u32> {
        self.chunks.iter().map(|(_, chunk)| *chunk)
    }

    /// Nodes of another kind.
    pub fn nodes(&self) -> impl Iterator<Item = u32> {
        self.nodes.iter().map(|(_, node)| *node)
    }
}

impl ChangeLog {
    /// Adds what led to a version: slots of triangles, and of vertices by whether they are in a chunk.
    pub fn note(&mut self, version: u64, changes: &Changes, chunk: impl Fn(u32) -> Option<u32>) {
        let known = self.triangles.len() + self.chunks.len() + self.nodes.len();
        if known + changes.triangles.len() > MOST {
            self.forget_older_half();
        }
        self.to = version;
        self.triangles
            .extend(changes.triangles.iter().map(|&slot| (version, slot)));
        for &vertex in &changes.vertices {
            match chunk(vertex) {
                // Vertices rise, so those of a chunk follow each other.
                Some(chunk) if self.chunks.last() != Some(&(version, chunk)) => self.chunks.push((version, chunk)),
                Some(_) => (),
                None => self.nodes.push((version, vertex)),
            }
        }
    }

    fn forget_older_half(&mut self) {
        let middle = self.triangles.get(self.triangles.len() / 2);
        self.from = middle.map_or(self.to, |(version, _)| *version);
        for entries in [&mut self.triangles, &mut self.chunks, &mut self.nodes] {
            entries.drain(..entries.partition_point(|(at, _)| *at <= self.from));
        }
    }

    /// What changed since a version; none if that is not known any more.
    pub fn since(&self, version: u64) -> Option<ChangesSince<'_>> {
        let after = |entries: &[(u64, u32)]| entries.partition_point(|(at, _)| *at <= version);
        (version >= self.from).then(|| ChangesSince {
            triangles: &self.triangles[after(&self.triangles)..],
            chunks: &self.chunks[after(&self.chunks)..],
            nodes: &self.nodes[after(&self.nodes)..],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reader_goes_on_where_it_stopped_or_is_told_that_it_cannot() {
        let mut log = ChangeLog::default();
        // Slots 0 to 9 are nodes, the others come in chunks of eight.
        let note = |log: &mut ChangeLog, version, triangles: &[u32], vertices: &[u32]| {
            let changes = Changes {
                triangles: triangles.to_vec(),
                vertices: vertices.to_vec(),
            };
            log.note(version, &changes, |vertex| vertex.checked_sub(10).map(|slot| slot / 8));
        };
        note(&mut log, 3, &[5, 6], &[4, 18, 20, 27]);
        note(&mut log, 4, &[6], &[26]);
        let read = |log: &ChangeLog, version: u64| {
            let since = log.since(version)?;
            let [triangles, chunks, nodes]: [Vec<u32>; 3] = [
                since.triangles().collect(),
                since.chunks().collect(),
                since.nodes().collect(),
            ];
            Some((triangles, chunks, nodes))
        };
        assert_eq!(read(&log, 0), Some((vec![5, 6, 6], vec![1, 2, 2], vec![4])));
        assert_eq!(read(&log, 3), Some((vec![6], vec![2], vec![])));
        assert_eq!(read(&log, 4), Some((vec![], vec![], vec![])));
        // The older half is dropped, whole versions at a time.
        let many: Vec<u32> = (0..MOST as u32).collect();
        note(&mut log, 7, &many, &[]);
        assert_eq!(read(&log, 0), None);
        let all: Vec<u32> = [6].into_iter().chain(many).collect();
        assert_eq!(read(&log, 3), Some((all, vec![2], vec![])));
    }

    #[test]
    fn a_reader_of_every_step_never_falls_back_and_the_log_stays_short() {
        /// Cuts of a step.
        const CUTS: u64 = 3;
        let mut log = ChangeLog::default();
        let mut read = 0;
        for version in 1..4000 {
            let changes = Changes {
                triangles: (0..97).collect(),
                vertices: vec![8, 9],
            };
            log.note(version, &changes, |vertex| Some(vertex / 8));
            if version % CUTS == 0 {
                let since = log.since(read).expect("what changed since the last step is known");
                assert_eq!(since.triangles().count() as u64, 97 * CUTS);
                read = version;
            }
            assert!(log.triangles.len() + log.chunks.len() <= MOST + 97);
        }
    }
}
