//! Which slots of a fine surface cuts have changed, for those that keep something a triangle: they read on from where they
//! stopped instead of looking at a hundred thousand triangles after each cut.

/// Entries that are kept; beyond, whoever has not read them looks at the whole surface.
const MOST: usize = 1 << 16;

/// The changes of the last cuts, each with the version of the surface that it led to, rising.
#[derive(Default)]
pub(crate) struct ChangeLog {
    triangles: Vec<(u64, u32)>,
    chunks: Vec<(u64, u32)>,
    /// The version before the first change that is kept, and after the last.
    from: u64,
    to: u64,
}

/// What changed since a version. A slot may be in a list more than once.
pub(crate) struct ChangesSince<'a> {
    triangles: &'a [(u64, u32)],
    chunks: &'a [(u64, u32)],
}

impl ChangesSince<'_> {
    /// Slots of triangles that came, went or were replaced.
    pub fn triangles(&self) -> impl Iterator<Item = u32> {
        self.triangles.iter().map(|(_, slot)| *slot)
    }

    /// Chunks of which a vertex came, went or was put elsewhere in its pentahedron.
    pub fn chunks(&self) -> impl Iterator<Item = u32> {
        self.chunks.iter().map(|(_, chunk)| *chunk)
    }
}

impl ChangeLog {
    /// Adds what led to a version.
    pub fn note(&mut self, version: u64, triangles: &[u32], chunks: impl Iterator<Item = u32>) {
        if self.triangles.len() + self.chunks.len() + triangles.len() > MOST {
            self.triangles.clear();
            self.chunks.clear();
            self.from = self.to;
        }
        self.to = version;
        self.triangles.extend(triangles.iter().map(|&slot| (version, slot)));
        let known = self.chunks.len();
        self.chunks.extend(chunks.map(|chunk| (version, chunk)));
        // Vertices rise, so those of a chunk follow each other.
        let mut last = None;
        let mut n = 0;
        self.chunks.retain(|&(_, chunk)| {
            n += 1;
            n <= known || last.replace(chunk) != Some(chunk)
        });
    }

    /// What changed since a version; none if that is not known any more.
    pub fn since(&self, version: u64) -> Option<ChangesSince<'_>> {
        let after = |entries: &[(u64, u32)]| entries.partition_point(|(at, _)| *at <= version);
        (version >= self.from).then(|| ChangesSince {
            triangles: &self.triangles[after(&self.triangles)..],
            chunks: &self.chunks[after(&self.chunks)..],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reader_goes_on_where_it_stopped_or_is_told_that_it_cannot() {
        let mut log = ChangeLog::default();
        log.note(3, &[5, 6], [1, 1, 2].into_iter());
        log.note(4, &[6], [2].into_iter());
        let read = |log: &ChangeLog, version: u64| {
            let since = log.since(version)?;
            Some((since.triangles().collect(), since.chunks().collect()))
        };
        assert_eq!(read(&log, 0), Some((vec![5, 6, 6], vec![1, 2, 2])));
        assert_eq!(read(&log, 3), Some((vec![6], vec![2])));
        assert_eq!(read(&log, 4), Some((vec![], vec![])));
        let many: Vec<u32> = (0..MOST as u32).collect();
        log.note(7, &many, [].into_iter());
        assert_eq!(read(&log, 3), None);
        assert_eq!(read(&log, 4), Some((many, vec![])));
    }
}
