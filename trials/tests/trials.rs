//! Short form of all campaigns. `SDFC_FUZZ=1000000` runs the long form.

#[path = "trials/claims.rs"]
mod claims;
#[path = "trials/damage.rs"]
mod damage;
#[path = "trials/limits.rs"]
mod limits;
#[path = "trials/oracle.rs"]
mod oracle;
#[path = "trials/programs.rs"]
mod programs;
#[path = "trials/regressions.rs"]
mod regressions;
#[path = "trials/scenes.rs"]
mod scenes;
