//! The optimizer: passes from graph to graph, in order, each of which can be disabled.

pub mod cse;
pub mod dead;
pub mod fold;
pub mod guards;
pub mod lipschitz;
pub mod lod;
mod pass;

use crate::graph::Graph;
use lod::LodReport;
pub use pass::{Context, Pass, PassEffect, PassOutput};

/// All passes, in the order in which they run.
pub const PASSES: [Pass; 6] = [
    Pass {
        name: "fold",
        summary: "folds constants and operations without effect; values stay the same",
        effect: PassEffect::Rounding,
        needs_lod_target: false,
        run: fold::fold,
    },
    Pass {
        name: "cse",
        summary: "merges equal nodes, also with operands exchanged; values stay the same",
        effect: PassEffect::None,
        needs_lod_target: false,
        run: cse::cse,
    },
    Pass {
        name: "lipschitz",
        summary: "reduces divisors of slopes that are larger than necessary; values stay safe steps",
        effect: PassEffect::LargerSteps,
        needs_lod_target: false,
        run: lipschitz::lipschitz,
    },
    Pass {
        name: "lod",
        summary: "with `--lod` only: simplifies details below the tolerance; values change by at most that",
        effect: PassEffect::Simplification,
        needs_lod_target: true,
        run: lod::lod,
    },
    Pass {
        name: "guards",
        summary: "adds guards that skip distant shapes; values stay the same",
        effect: PassEffect::None,
        needs_lod_target: false,
        run: guards::guards,
    },
    Pass {
        name: "dead",
        summary: "removes nodes that nothing reads; values stay the same",
        effect: PassEffect::None,
        needs_lod_target: false,
        run: dead::dead,
    },
];

/// Selection of passes.
#[derive(Clone, Debug, Default)]
pub struct PassOptions {
    /// Runs no pass (`-O0`).
    pub disable_all: bool,
    /// Names of the passes to leave out.
    pub disabled: Vec<String>,
}

/// Report of a pass.
#[derive(Clone, Debug, PartialEq)]
pub struct PassReport {
    /// Name of the pass.
    pub name: &'static str,
    /// Nodes of the graph before and after; `None` if the pass was left out.
    pub nodes: Option<[usize; 2]>,
    /// Changes that were made, in the pass's own terms.
    pub notes: Vec<String>,
    /// Error introduced by the pass, if it may change the value.
    pub loss: Option<LodReport>,
}

/// Runs all enabled passes; returns the graph and a report of each pass.
pub fn optimize(
    graph: &Graph,
    context: &Context,
    options: &PassOptions,
) -> (Graph, Vec<PassReport>) {
    let mut graph = graph.clone();
    let mut reports = Vec::with_capacity(PASSES.len());
    for pass in PASSES {
        let is_disabled = options.disable_all
            || options.disabled.iter().any(|name| name == pass.name)
            || (pass.needs_lod_target && context.lod_target.is_none());
        let mut report = PassReport {
            name: pass.name,
            nodes: None,
            notes: Vec::new(),
            loss: None,
        };
        if !is_disabled {
            let passed = (pass.run)(&graph, context);
            report.nodes = Some([graph.len(), passed.graph.len()]);
            report.notes = passed.notes;
            report.loss = passed.lod_report;
            graph = passed.graph;
        }
        reports.push(report);
    }
    (graph, reports)
}
