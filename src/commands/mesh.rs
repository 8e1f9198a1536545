//! `resecta mesh`: the lattice of a case in numbers, and as a file.

use std::path::PathBuf;

use clap::Args;
use resecta::{
    anatomy::{
        Case, Lattice, LatticeOptions,
        vtu::{self, VtuMesh},
    },
    solver::{Material, TissueMesh},
};

use super::{Failure, files, library};

/// Build the lattice of a case, print its numbers, and write it for ParaView or meshio
#[derive(Args)]
pub struct Mesh {
    /// A shipped case (small, medium, large, paper) or the path of a *.case.ron file
    case: String,
    /// Angle between two rays in degrees, the one knob of resolution
    #[arg(long, default_value_t = 8.0)]
    alpha: f64,
    /// Number of sections along the axis [default: from the mean segment length]
    #[arg(long, value_name = "C")]
    axial_points: Option<usize>,
    /// File to write, .vtu; an existing one is replaced [default: none]
    #[arg(long)]
    out: Option<PathBuf>,
}

impl Mesh {
    pub fn run(self) -> Result<(), Failure> {
        let case = library()?.load_case(&self.case)?;
        let options = LatticeOptions {
            alpha_deg: self.alpha,
            axial_points: self.axial_points,
        };
        let lattice = Lattice::build(&case, &options).map_err(|source| Failure::Lattice {
            case: self.case.clone(),
            source,
        })?;
        let material = Material::preset(&case.material).ok_or_else(|| Failure::Material {
            case: self.case.clone(),
            material: case.material.clone(),
            presets: Material::preset_names().collect(),
        })?;
        let springs = TissueMesh::from_lattice(&lattice, material.shear).springs.len();
        if let Some(file) = &self.out {
            files::write_with(file, |temporary| {
                vtu::write(temporary, &VtuMesh::from_lattice(&lattice))
            })?;
        }
        print_lattice(&case, &lattice, springs);
        print_approximations(&case);
        if let Some(file) = &self.out {
            println!("written to {}", file.display());
        }
        Ok(())
    }
}

fn print_lattice(case: &Case, lattice: &Lattice, springs: usize) {
    let (volume, contours) = (lattice.volume_mm3(), lattice.contour_volume_mm3);
    let quality = lattice.quality();
    let shape = lattice.shape;
    let line = |name: &str, value: String| println!("{name:<20}{value}");
    line("case", case.name.clone());
    line("source", case.source.description.clone());
    line("licence", case.source.licence.clone());
    line(
        "nodes",
        format!(
            "{} ({} slices, {} angles, {} layers)",
            lattice.node_count(),
            shape.slices,
            shape.angles,
            shape.layers
        ),
    );
    line(
        "springs",
        format!(
            "{} to axis neighbours, {springs} with those that resist shear (material {})",
            lattice.axis_spring_count(),
            case.material
        ),
    );
    line("pentahedra", lattice.pentahedron_count().to_string());
    line("segment l", format!("{:.3} mm", lattice.segment_mm));
    line("angle", format!("{:.4} degrees", lattice.angle_deg));
    let ml = |mm3: f64| format!("{mm3:.1} mm3 ({:.2} ml)", mm3 / 1000.0);
    line("lattice volume", ml(volume));
    line(
        "contour volume",
        format!(
            "{}, lattice {:+.3} %",
            ml(contours),
            100.0 * (volume - contours) / contours
        ),
    );
    line("inside the capsule", ml(lattice.capsule_volume_mm3));
    line(
        "element quality",
        format!("smallest {:.4}, mean {:.4}", quality.min, quality.mean),
    );
    if lattice.narrowed_rays > 0 {
        line(
            "lumen narrowed",
            format!("on {} rays, to leave a wall", lattice.narrowed_rays),
        );
    }
    if lattice.smoothed_sections > 0 {
        line(
            "sections evened out",
            format!("{}, so that no pentahedron is inverted", lattice.smoothed_sections),
        );
    }
}

/// What was filled in rather than measured, a line a rule.
pub fn print_approximations(case: &Case) {
    let mut by_rule: Vec<(&str, Vec<&str>)> = Vec::new();
    for approximation in &case.approximated {
        let rule = approximation.rule.as_str();
        let what = approximation.what.as_str();
        match by_rule.iter_mut().find(|(known, _)| *known == rule) {
            Some((_, fields)) => fields.push(what),
            None => by_rule.push((rule, vec![what])),
        }
    }
    for (rule, fields) in by_rule {
        let fields = match fields[..] {
            [first, .., last] if fields.len() > 3 => format!("{first} to {last} ({})", fields.len()),
            _ => fields.join(", "),
        };
        println!("approximated        {fields}: {rule}");
    }
}
