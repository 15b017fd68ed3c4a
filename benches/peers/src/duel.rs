//! sdfc against its peers: every model, size and number of threads, on every engine, in alternation.

use crate::clock::{median, timed};
use crate::contestant::sdfc::{RaySettings, pool};
use crate::contestant::{Contestant, SdfcEngine, Peer};
use crate::model::Model;
use crate::picture::PixelDifference;
use crate::report::{TableColumn, OutputFormat, BenchTable, note, print};
use sdfc_runtime::engine::EngineKind;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// Options of the comparison.
pub(crate) struct DuelOptions {
    /// Sides of the pictures in pixels.
    pub(crate) sizes: Vec<u32>,
    /// Numbers of threads.
    pub(crate) threads: Vec<usize>,
    /// sdfc's engines.
    pub(crate) engines: Vec<EngineKind>,
    /// Other renderers that are compared with sdfc.
    pub(crate) peers: Vec<Peer>,
    /// Settings of sdfc's rays.
    pub(crate) rays: RaySettings,
    /// Number of measured rounds.
    pub(crate) rounds: usize,
    /// Time after which no more rounds begin, in seconds.
    pub(crate) patience: f64,
}

/// sdfc and a peer on one picture. Times are medians in milliseconds.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct DuelRow {
    model: String,
    size: u32,
    /// Number of threads of the CPU engines, or `None` on a GPU.
    threads: Option<usize>,
    engine: &'static str,
    device: String,
    /// Time from the text to the picture: the sum of the next two.
    ms: f64,
    /// Time from the text to the compiled module.
    compile_ms: f64,
    /// Time from the compiled module to the picture.
    frame_ms: f64,
    /// Time of another picture of the loaded scene.
    again_ms: f64,
    peer: &'static str,
    peer_device: String,
    /// Time of the peer from the text to the picture.
    peer_ms: f64,
    /// Time from the text to the peer's compiled shape.
    peer_compile_ms: f64,
    /// Time from that shape to the picture.
    peer_frame_ms: f64,
    /// `ms / peer_ms`.
    ratio: f64,
    /// `frame_ms / peer_frame_ms`.
    frame_ratio: f64,
    /// Number of pixels that differ: in coverage, or by more than a voxel in depth.
    differing_pixels: usize,
    /// Number of pixels that differ in coverage.
    differing_coverage: usize,
    /// Number of pixels that agree except for the direction of the surface.
    differing_normals: usize,
    /// Fraction of the picture that the model covers.
    covered: f64,
    /// Number of measurements of each side.
    rounds: usize,
}

/// Runs all comparisons and prints them.
pub(crate) fn run(models: &[Model], options: &DuelOptions, format: OutputFormat) -> Result<(), String> {
    let table = BenchTable::new(
        "sdfc against peers",
        &[
            TableColumn::left("model"),
            TableColumn::right("size"),
            TableColumn::right("threads"),
            TableColumn::left("engine"),
            TableColumn::right("compile"),
            TableColumn::right("frame"),
            TableColumn::right("sum, ms"),
            TableColumn::right("again"),
            TableColumn::left("peer"),
            TableColumn::right("compile"),
            TableColumn::right("frame"),
            TableColumn::right("sum, ms"),
            TableColumn::right("ratio"),
            TableColumn::right("of frames"),
            TableColumn::right("pixels that differ"),
        ],
        format,
    );
    table.begin()?;
    let mut rows = Vec::new();
    for model in models {
        for &size in &options.sizes {
            for row in measure_picture(model, size, options) {
                table.row(&row, &cells(&row))?;
                rows.push(row);
            }
        }
    }
    table.end()?;
    match format {
        OutputFormat::Json => Ok(()),
        OutputFormat::Text | OutputFormat::Markdown => print(&summary(&rows)),
    }
}

/// Returns a sentence for each engine and number of threads: sums against those of the faster peer.
fn summary(rows: &[DuelRow]) -> String {
    let mut text = String::from("\n");
    let mut groups: Vec<(&str, Option<usize>)> = rows.iter().map(|row| (row.engine, row.threads)).collect();
    groups.sort();
    groups.dedup();
    for (engine, threads) in groups {
        let is_here = |row: &&DuelRow| row.engine == engine && row.threads == threads;
        let mut pictures: BTreeMap<(&str, u32), [f64; 2]> = BTreeMap::new();
        for row in rows.iter().filter(is_here) {
            let worst = pictures.entry((&row.model, row.size)).or_insert([0.0; 2]);
            *worst = [worst[0].max(row.ratio), worst[1].max(row.frame_ratio)];
        }
        let describe = |name: &str, index: usize, goal: f64| {
            let ratios = || pictures.values().map(|ratios| ratios[index]);
            let mean = (ratios().map(f64::ln).sum::<f64>() / pictures.len() as f64).exp();
            let reached = ratios().filter(|ratio| *ratio <= goal).count();
            format!("{name}: geometric mean {mean:.2}, at most {goal} in {reached} of {}", pictures.len())
        };
        let threads = threads.map_or(String::new(), |count| format!(", {count} threads"));
        let sums = describe("from text to picture", 0, 0.6);
        let frames = describe("frames", 1, 0.5);
        _ = writeln!(text, "{engine}{threads}, against the faster peer: {sums}; {frames}.");
    }
    text
}

fn cells(row: &DuelRow) -> Vec<String> {
    let ms = |ms: f64| format!("{ms:.1}");
    vec![
        row.model.clone(),
        format!("{0}²", row.size),
        row.threads.map_or("-".to_owned(), |n| n.to_string()),
        row.engine.to_owned(),
        ms(row.compile_ms),
        ms(row.frame_ms),
        ms(row.ms),
        ms(row.again_ms),
        row.peer.to_owned(),
        ms(row.peer_compile_ms),
        ms(row.peer_frame_ms),
        ms(row.peer_ms),
        format!("{:.2}", row.ratio),
        format!("{:.2}", row.frame_ratio),
        row.differing_pixels.to_string(),
    ]
}

/// Measures all rows of one picture. Failures are reported and skipped.
fn measure_picture(model: &Model, size: u32, options: &DuelOptions) -> Vec<DuelRow> {
    let mut rows = Vec::new();
    for &engine in &options.engines {
        let peers: Vec<Peer> = options
            .peers
            .iter()
            .copied()
            .filter(|p| p.matches(engine))
            .collect();
        // The number of threads does not affect a GPU.
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

/// A contestant with its times in milliseconds.
struct Participant<'a> {
    contestant: Box<dyn Contestant + 'a>,
    frame_times: Vec<f64>,
    compile_times: Vec<f64>,
    redraw_times: Vec<f64>,
}

impl<'a> Participant<'a> {
    fn new(contestant: Box<dyn Contestant + 'a>) -> Self {
        Self {
            contestant,
            frame_times: Vec::new(),
            compile_times: Vec::new(),
            redraw_times: Vec::new(),
        }
    }

    /// Runs one round, and returns its time in milliseconds.
    fn take_turn(&mut self) -> Result<f64, String> {
        let (result, compile_ms) = timed(|| self.contestant.prepare());
        result?;
        let (result, frame_ms) = timed(|| self.contestant.frame());
        result?;
        self.compile_times.push(compile_ms);
        self.frame_times.push(frame_ms);
        let (result, redraw_ms) = timed(|| self.contestant.redraw());
        if let Some(result) = result {
            result?;
            self.redraw_times.push(redraw_ms);
        }
        Ok(compile_ms + frame_ms + redraw_ms)
    }

    fn discard_times(&mut self) {
        self.frame_times.clear();
        self.compile_times.clear();
        self.redraw_times.clear();
    }
}

/// Measures an engine and its peers on one picture, in alternation.
fn side_by_side(
    model: &Model,
    size: u32,
    engine: EngineKind,
    peers: &[Peer],
    threads: usize,
    options: &DuelOptions,
) -> Result<Vec<DuelRow>, String> {
    let mut sdfc_entry = Participant::new(Box::new(SdfcEngine::open(engine, model, size, options.rays)?));
    let mut peer_entries = Vec::new();
    for peer in peers {
        match peer.open(model, size, threads) {
            Ok(contestant) => peer_entries.push((*peer, Participant::new(contestant))),
            Err(problem) => note(&problem),
        }
    }
    if peer_entries.is_empty() {
        return Ok(Vec::new());
    }
    let mut spent_ms = 0.0;
    for round in 0..=options.rounds {
        spent_ms += sdfc_entry.take_turn()?;
        for (peer, entry) in &mut peer_entries {
            spent_ms += entry
                .take_turn()
                .map_err(|problem| format!("{peer}: {problem}"))?;
        }
        if spent_ms > options.patience * 1e3 {
            break;
        }
        if round == 0 && options.rounds > 0 {
            sdfc_entry.discard_times();
            peer_entries.iter_mut().for_each(|(_, entry)| entry.discard_times());
        }
    }
    let picture = sdfc_entry.contestant.picture()?;
    let (compile_ms, frame_ms) = (median(&sdfc_entry.compile_times), median(&sdfc_entry.frame_times));
    peer_entries
        .iter()
        .map(|(peer, entry)| {
            let other = entry.contestant.picture()?;
            let difference = PixelDifference::between(&picture, &other)
                .ok_or_else(|| format!("{peer} drew another kind of picture"))?;
            let (peer_compile_ms, peer_frame_ms) = (median(&entry.compile_times), median(&entry.frame_times));
            let (ms, peer_ms) = (compile_ms + frame_ms, peer_compile_ms + peer_frame_ms);
            Ok(DuelRow {
                model: model.name.clone(),
                size,
                threads: (engine == EngineKind::Cpu).then_some(threads),
                engine: engine.name(),
                device: sdfc_entry.contestant.device(),
                ms,
                compile_ms,
                frame_ms,
                again_ms: median(&sdfc_entry.redraw_times),
                peer: peer.name(),
                peer_device: entry.contestant.device(),
                peer_ms,
                peer_compile_ms,
                peer_frame_ms,
                ratio: ms / peer_ms,
                frame_ratio: frame_ms / peer_frame_ms,
                differing_pixels: difference.pixels(),
                differing_coverage: difference.coverage,
                differing_normals: difference.normal,
                covered: other.covered(),
                rounds: entry.frame_times.len(),
            })
        })
        .collect()
}
