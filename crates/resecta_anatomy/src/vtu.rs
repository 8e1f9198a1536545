//! Export of a mesh of pentahedra as VTK's XML unstructured grid (`.vtu`, wedge cells, data as text).
//!
//! Opens in ParaView and in Python's meshio; meshio turns wedges into Gmsh's order as it reads (nodes 1 and 2, 4 and 5
//! exchanged), in which the normal of the first triangle points inwards. Numbers are written with as many digits as bring
//! the same value back, so the same mesh always gives the same bytes.

use std::fmt::{Display, Write as _};
use std::path::Path;
use std::{fs, io};

use glam::DVec3;

use crate::{Lattice, quality};

/// VTK's number for a wedge.
const VTK_WEDGE: u8 = 13;

/// A mesh to write.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct VtuMesh {
    /// Places of the points, mm.
    pub points: Vec<DVec3>,
    /// Points of the wedges, in the order of [`crate::wedge`].
    pub wedges: Vec<[u32; 6]>,
    /// Named values, one a point.
    pub point_data: Vec<(String, VtuData)>,
    /// Named values, one a wedge.
    pub cell_data: Vec<(String, VtuData)>,
}

/// Values of one field.
#[derive(Debug, Clone, PartialEq)]
pub enum VtuData {
    /// Real numbers.
    Scalars(Vec<f64>),
    /// Vectors.
    Vectors(Vec<DVec3>),
    /// Whole numbers: indices, kinds.
    Integers(Vec<i64>),
}

impl VtuData {
    fn len(&self) -> usize {
        match self {
            Self::Scalars(values) => values.len(),
            Self::Vectors(values) => values.len(),
            Self::Integers(values) => values.len(),
        }
    }

    fn is_finite(&self) -> bool {
        match self {
            Self::Scalars(values) => values.iter().all(|value| value.is_finite()),
            Self::Vectors(values) => values.iter().all(|value| value.is_finite()),
            Self::Integers(_) => true,
        }
    }
}

impl VtuMesh {
    /// A lattice at rest: slice, ray and layer of every point; zone (by [`crate::Zone::index`]) and quality (scaled
    /// Jacobian) of every wedge.
    pub fn from_lattice(lattice: &Lattice) -> Self {
        let coordinate = |axis: usize| {
            let of = |node| i64::from(lattice.shape.coordinates(node)[axis]);
            VtuData::Integers((0..lattice.positions.len() as u32).map(of).collect())
        };
        let zones = lattice.zones.iter().map(|zone| zone.index() as i64).collect();
        let place = |node: u32| lattice.positions[node as usize];
        let qualities = (lattice.pentahedra.iter())
            .map(|nodes| quality::scaled_jacobian(nodes, place))
            .collect();
        Self {
            points: lattice.positions.clone(),
            wedges: lattice.pentahedra.clone(),
            point_data: (["slice", "ray", "layer"].into_iter().enumerate())
                .map(|(axis, name)| (name.to_owned(), coordinate(axis)))
                .collect(),
            cell_data: vec![
                ("zone".to_owned(), VtuData::Integers(zones)),
                ("quality".to_owned(), VtuData::Scalars(qualities)),
            ],
        }
    }
}

/// Writes `mesh` to `path`, replacing what is there.
///
/// # Errors
///
/// [`io::ErrorKind::InvalidInput`], before anything is written, where a field has another length than the points or wedges,
/// a wedge names a point that is not there, or a value is not finite; otherwise what the file system says.
pub fn write(path: &Path, mesh: &VtuMesh) -> io::Result<()> {
    check(mesh).map_err(|rule| io::Error::new(io::ErrorKind::InvalidInput, rule))?;
    fs::write(path, text(mesh))
}

fn check(mesh: &VtuMesh) -> Result<(), String> {
    if let Some(point) = mesh.points.iter().position(|point| !point.is_finite()) {
        return Err(format!("point {point} is not finite"));
    }
    let outside = |wedge: &[u32; 6]| wedge.iter().any(|&node| node as usize >= mesh.points.len());
    if let Some(wedge) = mesh.wedges.iter().position(outside) {
        return Err(format!(
            "wedge {wedge} names a point beyond the {} given",
            mesh.points.len()
        ));
    }
    let of_points = mesh.point_data.iter().map(|field| (field, mesh.points.len()));
    let of_wedges = mesh.cell_data.iter().map(|field| (field, mesh.wedges.len()));
    for ((name, data), expected) in of_points.chain(of_wedges) {
        if data.len() != expected {
            return Err(format!("field {name} has {} values; expected {expected}", data.len()));
        }
        if !data.is_finite() {
            return Err(format!("field {name} has a value that is not finite"));
        }
    }
    Ok(())
}

fn text(mesh: &VtuMesh) -> String {
    let mut out = String::from("<?xml version=\"1.0\"?>\n");
    out.push_str(
        "<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" byte_order=\"LittleEndian\">\n<UnstructuredGrid>\n",
    );
    let (points, wedges) = (mesh.points.len(), mesh.wedges.len());
    // Writing to a string cannot fail.
    let _ = writeln!(out, "<Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{wedges}\">");
    out.push_str("<Points>\n");
    vectors(&mut out, "Points", &mesh.points);
    out.push_str("</Points>\n<Cells>\n");
    let nodes = mesh.wedges.iter().flatten();
    array(&mut out, "Int64", "connectivity", 1, nodes);
    array(&mut out, "Int64", "offsets", 1, (1..=wedges).map(|wedge| 6 * wedge));
    array(&mut out, "UInt8", "types", 1, std::iter::repeat_n(VTK_WEDGE, wedges));
    out.push_str("</Cells>\n");
    for (tag, fields) in [("PointData", &mesh.point_data), ("CellData", &mesh.cell_data)] {
        let _ = writeln!(out, "<{tag}>");
        for (name, data) in fields {
            match data {
                VtuData::Scalars(values) => array(&mut out, "Float64", name, 1, values),
                VtuData::Vectors(values) => vectors(&mut out, name, values),
                VtuData::Integers(values) => array(&mut out, "Int64", name, 1, values),
            }
        }
        let _ = writeln!(out, "</{tag}>");
    }
    out.push_str("</Piece>\n</UnstructuredGrid>\n</VTKFile>\n");
    out
}

fn vectors(out: &mut String, name: &str, values: &[DVec3]) {
    array(
        out,
        "Float64",
        name,
        3,
        values.iter().flat_map(|value| value.to_array()),
    );
}

fn array(out: &mut String, kind: &str, name: &str, components: usize, values: impl IntoIterator<Item = impl Display>) {
    let name = escaped(name);
    let _ = write!(out, "<DataArray type=\"{kind}\" Name=\"{name}\" format=\"ascii\"");
    if components > 1 {
        let _ = write!(out, " NumberOfComponents=\"{components}\"");
    }
    out.push_str(">\n");
    for (place, value) in values.into_iter().enumerate() {
        // Lines of a dozen numbers: readable, and no reader meets a line of megabytes.
        let _ = write!(out, "{value}{}", if place % 12 == 11 { '\n' } else { ' ' });
    }
    out.push_str("\n</DataArray>\n");
}

fn escaped(name: &str) -> String {
    name.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one_wedge() -> VtuMesh {
        VtuMesh {
            points: (0..6).map(|n| DVec3::new(f64::from(n) / 3.0, 1e-17, -2.5)).collect(),
            wedges: vec![[0, 1, 2, 3, 4, 5]],
            point_data: vec![("height \"<&".to_owned(), VtuData::Vectors(vec![DVec3::Z; 6]))],
            cell_data: vec![("zone".to_owned(), VtuData::Integers(vec![-2]))],
        }
    }

    /// Numbers of the first array of that name.
    fn numbers(text: &str, name: &str) -> Vec<f64> {
        let start = text.find(&format!("Name=\"{name}\"")).unwrap();
        let body = &text[start + text[start..].find('>').unwrap() + 1..];
        body[..body.find('<').unwrap()]
            .split_whitespace()
            .map(|word| word.parse().unwrap())
            .collect()
    }

    #[test]
    fn every_number_comes_back_as_it_was() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("one.vtu");
        let mesh = one_wedge();
        write(&path, &mesh).unwrap();
        let text = fs::read_to_string(path).unwrap();
        let points: Vec<f64> = mesh.points.iter().flat_map(|point| point.to_array()).collect();
        assert_eq!(numbers(&text, "Points"), points);
        assert_eq!(numbers(&text, "connectivity"), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!(numbers(&text, "offsets"), [6.0]);
        assert_eq!(numbers(&text, "types"), [13.0]);
        assert_eq!(numbers(&text, "zone"), [-2.0]);
        assert_eq!(numbers(&text, "height &quot;&lt;&amp;").len(), 18);
    }

    #[test]
    fn a_mesh_that_no_reader_could_open_is_refused_and_nothing_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bad.vtu");
        let faults: [fn(&mut VtuMesh); 4] = [
            |mesh| mesh.points[3].y = f64::NAN,
            |mesh| mesh.wedges[0][5] = 6,
            |mesh| mesh.cell_data[0].1 = VtuData::Integers(vec![1, 2]),
            |mesh| mesh.point_data[0].1 = VtuData::Scalars(vec![f64::INFINITY; 6]),
        ];
        for fault in faults {
            let mut mesh = one_wedge();
            fault(&mut mesh);
            assert_eq!(write(&path, &mesh).unwrap_err().kind(), io::ErrorKind::InvalidInput);
            assert!(!path.exists());
        }
    }
}
