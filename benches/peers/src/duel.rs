//! sdfc against its peers: every model, size and number of threads, on every engine, taking turns.

use crate::clock::{median, timed};
use crate::contestant::ours::{Rays, pool};
use crate::contestant::{Contestant, Ours, Peer};
use crate::model::Model;
use crate::picture::Difference;
use crate::report::{Column, Form, Table, note};
use sdfc_runtime::engine::EngineKind;
use serde::Serialize;

/// What is measured.
pub(crate) struct Options {
    /// Sides of the pictures; each model's own if empty.
    pub(crate) sizes: Vec<u32>,
    /// Numbers of threads.
    pub(crate) threads: Vec<usize>,
    /// sdfc's engines.
    pub(crate) engines: Vec<EngineKind>,
    /// The peers.
    pub(crate) peers: Vec<Peer>,
    /// How sdfc's rays go.
    pub(crate) rays: Rays,
    /// How many rounds count.
    pub(crate) rounds: usize,
    /// After how many seconds no more rounds are begun.
    pub(crate) patience: f64,
}

/// sdfc and a peer on one picture. Times are medians, in milliseconds.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Row {
    model: String,
    size: u32,
    /// How many threads the CPU engines have; none for those on a GPU.
    threads: Option<usize>,
    engine: &'static str,
    device: String,
    /// From the compiled module to the picture.
    ms: f64,
    /// From the text to the compiled module.
    compile_ms: f64,
    /// Another picture of the scene that is loaded.
    again_ms: f64,
    peer: &'static str,
    peer_device: String,
    /// From the peer's compiled shape to the picture.
    peer_ms: f64,
    /// From the text to that shape.
    peer_compile_ms: f64,
    /// `ms / peer_ms`.
    ratio: f64,
    /// How many pixels differ: in coverage, or by more than a voxel in depth.
    differing_pixels: usize,
    /// Those that differ in coverage.
    differing_coverage: usize,
    /// Those that agree, but for the direction of the surface.
    differing_normals: usize,
    /// The share of the picture that the model covers.
    covered: f64,
    /// How often each side was measured.
    rounds: usize,
}

/// Runs everything and prints it.
pub(crate) fn run(models: &[Model], options: &Options, form: Form) -> Result<(), String> {
    let table = Table::new(
        "sdfc against peers",
        &[
            Column::left("model"),
            Column::right("size"),
            Column::right("threads"),
            Column::left("engine"),
            Column::right("ms"),
            Column::right("again"),
            Column::right("compile"),
            Column::left("peer"),
            Column::right("ms"),
            Column::right("compile"),
            Column::right("ratio"),
            Column::right("pixels that differ"),
        ],
        form,
    );
    table.begin()?;
    for model in models {
        let sizes = match options.sizes.as_slice() {
            [] => model.sizes,
            given => given,
        };
        for &size in sizes {
            for row in of_picture(model, size, options) {
                table.row(&row, &cells(&row))?;
            }
        }
    }
    table.end()
}

fn cells(row: &Row) -> Vec<String> {
    let ms = |ms: f64| format!("{ms:.1}");
    vec![
        row.model.clone(),
        format!("{0}²", row.size),
        row.threads.map_or("-".to_owned(), |n| n.to_string()),
        row.engine.to_owned(),
        ms(row.ms),
        ms(row.again_ms),
        ms(row.compile_ms),
        row.peer.to_owned(),
        ms(row.peer_ms),
        ms(row.peer_compile_ms),
        format!("{:.2}", row.ratio),
        row.differing_pixels.to_string(),
    ]
}

/// All rows of one picture. What cannot be measured is told and left out.
fn of_picture(model: &Model, size: u32, options: &Options) -> Vec<Row> {
    let mut rows = Vec::new();
    for &engine in &options.engines {
        let peers: Vec<Peer> = options
            .peers
            .iter()
            .copied()
            .filter(|p| p.matches(engine))
            .collect();
        // Threads make no difference to a GPU.
        let threads: &[usize] = match engine {
            EngineKind::Cpu | EngineKind::Reference => &options.threads,
            EngineKind::Interp | EngineKind::Wgsl => &[1],
        };
        for &threads in threads {
            let measured = pool(threads).and_then(|pool| {
                pool.install(|| side_by_side(model, size, engine, &peers, threads, options))
            });
            match measured {
                Ok(measured) => rows.extend(measured),
                Err(problem) => note(&format!("{} {size}², {engine}: {problem}", model.name)),
            }
        }
    }
    rows
}

/// One that takes part, and its times.
struct Entry<'a> {
    contestant: Box<dyn Contestant + 'a>,
    frames: Vec<f64>,
    compiling: Vec<f64>,
    again: Vec<f64>,
}

impl<'a> Entry<'a> {
    fn new(contestant: Box<dyn Contestant + 'a>) -> Self {
        Self {
            contestant,
            frames: Vec::new(),
            compiling: Vec::new(),
            again: Vec::new(),
        }
    }

    /// Takes a turn; gives the milliseconds it took.
    fn turn(&mut self) -> Result<f64, String> {
        let (result, compiling) = timed(|| self.contestant.prepare());
        result?;
        let (result, frame) = timed(|| self.contestant.frame());
        result?;
        self.compiling.push(compiling);
        self.frames.push(frame);
        let (result, again) = timed(|| self.contestant.again());
        if let Some(result) = result {
            result?;
            self.again.push(again);
        }
        Ok(compiling + frame + again)
    }

    fn forget(&mut self) {
        self.frames.clear();
        self.compiling.clear();
        self.again.clear();
    }
}

/// An engine and its peers on one picture, in turns.
fn side_by_side(
    model: &Model,
    size: u32,
    engine: EngineKind,
    peers: &[Peer],
    threads: usize,
    options: &Options,
) -> Result<Vec<Row>, String> {
    let mut ours = Entry::new(Box::new(Ours::open(engine, model, size, options.rays)?));
    let mut theirs = Vec::new();
    for peer in peers {
        match peer.open(model, size, threads) {
            Ok(contestant) => theirs.push((*peer, Entry::new(contestant))),
            Err(problem) => note(&problem),
        }
    }
    if theirs.is_empty() {
        return Ok(Vec::new());
    }
    let mut spent = 0.0;
    for round in 0..=options.rounds {
        spent += ours.turn()?;
        for (peer, entry) in &mut theirs {
            spent += entry
                .turn()
                .map_err(|problem| format!("{peer}: {problem}"))?;
        }
        if spent > options.patience * 1e3 {
            break;
        }
        if round == 0 && options.rounds > 0 {
            ours.forget();
            theirs.iter_mut().for_each(|(_, entry)| entry.forget());
        }
    }
    let picture = ours.contestant.picture()?;
    let ms = median(&ours.frames);
    theirs
        .iter()
        .map(|(peer, entry)| {
            let other = entry.contestant.picture()?;
            let difference = Difference::between(&picture, &other)
                .ok_or_else(|| format!("{peer} drew another kind of picture"))?;
            let peer_ms = median(&entry.frames);
            Ok(Row {
                model: model.name.clone(),
                size,
                threads: (engine == EngineKind::Cpu).then_some(threads),
                engine: engine.name(),
                device: ours.contestant.device(),
                ms,
                compile_ms: median(&ours.compiling),
                again_ms: median(&ours.again),
                peer: peer.name(),
                peer_device: entry.contestant.device(),
                peer_ms,
                peer_compile_ms: median(&entry.compiling),
                ratio: ms / peer_ms,
                differing_pixels: difference.pixels(),
                differing_coverage: difference.coverage,
                differing_normals: difference.normal,
                covered: other.covered(),
                rounds: entry.frames.len(),
            })
        })
        .collect()
}
