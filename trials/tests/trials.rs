//! A share of all campaigns; `SDFC_FUZZ=1000000` runs the long form.

#[path = "trials/claims.rs"]
mod claims;
#[path = "trials/damage.rs"]
mod damage;
#[path = "trials/found.rs"]
mod found;
#[path = "trials/limits.rs"]
mod limits;
#[path = "trials/oracle.rs"]
mod oracle;
#[path = "trials/programs.rs"]
mod programs;
#[path = "trials/scenes.rs"]
mod scenes;
