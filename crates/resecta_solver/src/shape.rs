//! What has become of the shape of pentahedra: turned inside out, or drawn out.

use glam::DVec3;
use resecta_anatomy::wedge;

use crate::tissue::Tissue;

/// Square of the longest edge of a pentahedron with its corners among some places, mm².
pub(crate) fn longest_edge_squared(nodes: &[u32; 6], places: &[DVec3]) -> f32 {
    let squared = |ends: &[usize; 2]| {
        let [from, to] = ends.map(|corner| places[nodes[corner] as usize]);
        from.distance_squared(to) as f32
    };
    wedge::EDGES.iter().map(squared).fold(0.0, f32::max)
}

impl Tissue {
    /// The living pentahedra that have no volume or are turned inside out, rising. Springs alone do not always bring back
    /// what was turned far inside out: `docs/hard_cases.md`. Looks at all.
    pub fn inverted_pentahedra(&self) -> Vec<u32> {
        self.inverted().collect()
    }

    /// How many living pentahedra have no volume or are turned inside out.
    pub fn inverted_count(&self) -> usize {
        self.inverted().count()
    }

    fn inverted(&self) -> impl Iterator<Item = u32> + '_ {
        self.living_pentahedron_indices()
            .filter(|&pentahedron| self.volume_of(pentahedron) <= 0.0)
    }

    /// The living pentahedra with an edge longer than `times` (above 0) their longest edge at rest, rising. Looks at all.
    ///
    /// An edge is not compared with its own length at rest: the short edges around a narrow lumen become several times as long when it
    /// opens, while the pentahedron hardly changes.
    pub fn drawn_out_pentahedra(&self, times: f32) -> Vec<u32> {
        let limit = times * times;
        let is_drawn_out = |&pentahedron: &u32| {
            let corners = self.pentahedron_nodes(pentahedron).map(|node| self.position(node));
            let most = limit * self.pentahedra.longest_edge_squared[pentahedron as usize];
            wedge::EDGES
                .iter()
                .any(|&[from, to]| corners[from].distance_squared(corners[to]) > most)
        };
        self.living_pentahedron_indices().filter(is_drawn_out).collect()
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::{Material, TissueMesh};

    /// A pentahedron whose triangles have two edges of a length along x and y, mm, and which is so high.
    fn prism(edge: i32, height: i32) -> Tissue {
        let triangle = [[0, 0], [0, edge], [edge, 0]];
        let place = |z: i32| triangle.map(|[x, y]| glam::IVec3::new(x, y, z).as_dvec3());
        let places = [place(0), place(height)].concat();
        let mesh = TissueMesh::from_pentahedra(places, vec![[0, 1, 2, 3, 4, 5]]);
        Tissue::new(&mesh, &Material::default()).expect("a prism is a tissue")
    }

    #[test]
    fn a_pentahedron_is_drawn_out_by_its_longest_edge_at_rest_and_no_shorter_one() {
        let mut tissue = prism(1, 4);
        let mut move_by = |way: Vec3| {
            let place = tissue.position(2) + way;
            tissue.set_position(2, place).expect("a finite place");
            (tissue.drawn_out_pentahedra(3.0), tissue.drawn_out_pentahedra(2.0))
        };
        // An edge of 1 mm is 8 mm long now, which is twice the longest; then 12.
        assert_eq!(move_by(Vec3::X * 6.9), (vec![], vec![]));
        assert_eq!(move_by(Vec3::X * 3.0), (vec![], vec![0]));
        assert_eq!(move_by(Vec3::X * 2.0), (vec![0], vec![0]));
    }

    #[test]
    fn what_is_turned_inside_out_is_counted() {
        let mut tissue = prism(2, 2);
        assert_eq!(tissue.inverted_count(), 0);
        for node in 3..6 {
            let place = tissue.position(node) - Vec3::Z * 5.0;
            tissue.set_position(node, place).expect("a finite place");
        }
        assert_eq!(tissue.inverted_pentahedra(), vec![0]);
        assert_eq!(tissue.inverted_count(), 1);
    }
}
