//! Integrators for mass-spring tissue side by side: what each costs for which error, in which kind of scene.
//!
//! Every method runs in double precision on one force kernel ([`system::System::forces`]); the implicit ones share one
//! product with the stiffness ([`stiffness::Stiffness::product`]). The product's own solver runs beside them.
//! [`write_report`] measures all regimes and writes charts, tables and raw numbers. Beside them stand cuts finer than the
//! elements, against exact solids: [`write_cuts`].
//!
//! | to find | look in |
//! |---|---|
//! | what is integrated, the force kernel | `system.rs` |
//! | the stiffness product, linear equations, an implicit stage | `stiffness.rs`, `conjugate.rs`, `implicit.rs` |
//! | a method | `methods/` |
//! | the stability bound, the slowest mode | `spectrum.rs` |
//! | scenes | `lattice.rs`, `regimes.rs` |
//! | references, conditioning, rows | `conditions.rs`, `measure.rs` |
//! | what the product says of its own error, and reaches an aim with | `aims.rs` |
//! | who wins, the rule for a choice | `choice.rs`, `rule.rs` |
//! | cuts: scenes, errors, costs | `cuts/` |
//! | the pages | `report/` |
//!
//! Units are mm, g and s throughout, so force is in µN and stiffness in µN/mm.

pub mod aims;
pub mod choice;
pub mod conditions;
pub mod conjugate;
pub mod cuts;
pub mod implicit;
pub mod lattice;
pub mod measure;
pub mod method;
pub mod methods;
pub mod regimes;
mod report;
pub mod rule;
pub mod spectrum;
pub mod stiffness;
pub mod system;

pub use report::{
    Advice, Chart, Cuts, Measured, Progress, ReportError, Series, Summary, plain, processor, table, write_cuts,
    write_cuts_of, write_report, write_report_of,
};
