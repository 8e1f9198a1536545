//! `resecta rates`: updates a second beside the papers' and the error of the step.

use clap::Args;
use resecta::{
    rates::{self, Rate},
    solver::{Material, ShearResistance},
    tissue::CutDetail,
};
use serde_json::{Value, json};

use super::{Failure, library};

/// Measure updates a second at alpha 7 to 11, beside the papers' and the error of the step
#[derive(Args)]
pub struct Rates {
    /// A shipped case or the path of a *.case.ron file; `paper` has the papers' 10,800 nodes at 8 degrees
    #[arg(long, default_value = "paper")]
    case: String,
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
}

impl Rates {
    pub fn run(self) -> Result<(), Failure> {
        let case = library()?.load_case(&self.case)?;
        let material = Material::preset(&case.material).ok_or_else(|| Failure::Material {
            case: self.case.clone(),
            material: case.material.clone(),
            presets: Material::preset_names().collect(),
        })?;
        let papers_lattice = Material {
            shear: ShearResistance::None,
            ..material.clone()
        };
        let measure = |material: &Material, detail: CutDetail| -> Result<Vec<Rate>, Failure> {
            let rates = rates::PAPER
                .iter()
                .map(|(alpha, _)| rates::measure(&case, *alpha, material, detail));
            rates.collect::<Result<_, _>>().map_err(|source| Failure::Rates {
                case: self.case.clone(),
                source,
            })
        };
        let rows = measure(&papers_lattice, CutDetail::Elements)?;
        let resisting = measure(&material, CutDetail::Elements)?;
        let fine = measure(&material, CutDetail::Field { spacing_mm: 0.5 })?;
        if self.json {
            let list = |rates: &[Rate]| rates.iter().map(row).collect::<Vec<Value>>();
            println!(
                "{}",
                json!({
                    "rows": list(&rows),
                    "rows_with_shear_resistance": list(&resisting),
                    "rows_cut_finely": list(&fine),
                })
            );
        } else {
            println!(
                "An update: collision, resection with c_r = 5 mm, deformation over 1/60 s, surface rebuild; one thread."
            );
            println!("At rest: an update of a gland that nothing touches, over one of the gland that is cut.");
            println!("Papers: one processor of 1 GHz. Error: of one update's deformation, RMS over the nodes.");
            print_table("The lattice of the papers, six neighbours a node", &rows);
            print_table("The material of the case, which resists shear", &resisting);
            print_table("The same, cut with a spacing of 0.5 mm", &fine);
        }
        Ok(())
    }
}

fn print_table(title: &str, rates: &[Rate]) {
    println!("\n{title}\n");
    println!(
        "{:>5} {:>7} {:>8} {:>10} {:>9} {:>9} {:>8} {:>9} {:>9} {:>8}",
        "alpha", "nodes", "springs", "pentahedra", "papers/s", "ours/s", "times", "substeps", "error mm", "at rest"
    );
    for rate in rates {
        let paper = rate.paper_updates_per_s.unwrap_or(f64::NAN);
        println!(
            "{:>5.1} {:>7} {:>8} {:>10} {:>9.2} {:>9.1} {:>8.1} {:>9} {:>9.1e} {:>6.1} %",
            rate.alpha_deg,
            rate.nodes,
            rate.springs,
            rate.pentahedra,
            paper,
            rate.updates_per_s,
            rate.updates_per_s / paper,
            rate.substeps,
            rate.rms_error_mm,
            100.0 * rate.quiet_share
        );
    }
}

fn row(rate: &Rate) -> Value {
    json!({
        "alpha_deg": rate.alpha_deg,
        "angle_used_deg": rate.angle_used_deg,
        "nodes": rate.nodes,
        "springs": rate.springs,
        "pentahedra": rate.pentahedra,
        "updates_per_s": rate.updates_per_s,
        "rms_error_mm": rate.rms_error_mm,
        "paper_updates_per_s": rate.paper_updates_per_s,
        "quiet_update_share": rate.quiet_share,
        "substeps": rate.substeps,
        "pentahedra_resected_an_update": rate.resected,
        "updates": rate.updates,
    })
}
