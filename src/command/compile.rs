//! `sdfc compile`: what a scene becomes, stage by stage.

use crate::failure::{Failure, INPUT};
use crate::output;
use crate::scene::{self, Build, Detail};
use crate::terminal::Terminal;
use clap::ValueEnum;
use sdfc_compiler::compile::Compiled;
use sdfc_compiler::dump::dump;
use sdfc_compiler::export::{Target, translate};
use sdfc_compiler::open::{Content, Outcome};
use sdfc_compiler::scene::Scene;
use sdfc_lang::{Diagnostics, Sources};
use sdfc_runtime::settings::Overrides;
use sdfc_vm::{file, listing};
use std::cmp::Ordering;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Show or write what a scene becomes, at any stage.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// The scene: .sdf, .sdfb or .vm.
    scene: PathBuf,
    /// The stage.
    #[arg(long, value_enum, value_name = "STAGE", default_value = "asm")]
    emit: Stage,
    /// Where to; without it, to standard output.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Say on standard error what each pass did, and what the program takes.
    #[arg(long)]
    stats: bool,
    #[command(flatten)]
    detail: Detail,
    #[command(flatten)]
    build: Build,
}

/// A stage of the compiler, in order, and what it exports to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Stage {
    /// The syntax tree.
    Ast,
    /// Names, types and loops resolved.
    Scene,
    /// Operations, each once.
    Graph,
    /// The same after the optimizing passes.
    Optimized,
    /// A listing of the program.
    Asm,
    /// The program as a file, for `sdfc` to read.
    Bytecode,
    /// The scene as functions in WGSL.
    Wgsl,
    /// … in GLSL.
    Glsl,
    /// … in HLSL.
    Hlsl,
    /// … in Metal's language.
    Msl,
    /// … in SPIR-V, which is no text.
    Spirv,
    /// A page for Shadertoy.
    Shadertoy,
}

impl Stage {
    fn is_text(self) -> bool {
        !matches!(self, Self::Bytecode | Self::Spirv)
    }
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<(), Failure> {
    let stage = arguments.emit;
    let bytes = emitted(arguments, terminal)?;
    output::deliver(arguments.output.as_deref(), &bytes, stage.is_text())
}

fn emitted(arguments: &Arguments, terminal: &Terminal) -> Result<Vec<u8>, Failure> {
    let Arguments {
        scene: path,
        emit: stage,
        build,
        detail,
        ..
    } = arguments;
    let target = match stage {
        Stage::Ast => return Ok(tree(path, terminal)?.into_bytes()),
        Stage::Scene => {
            let scene = scene::told(elaborated(path, build)?, terminal)?;
            return Ok(dump(&scene).into_bytes());
        }
        Stage::Graph | Stage::Optimized | Stage::Asm | Stage::Bytecode => None,
        Stage::Wgsl => Some(Target::Wgsl),
        Stage::Glsl => Some(Target::Glsl),
        Stage::Hlsl => Some(Target::Hlsl),
        Stage::Msl => Some(Target::Msl),
        Stage::Spirv => Some(Target::Spirv),
        Stage::Shadertoy => Some(Target::Shadertoy),
    };
    // For the scene's own camera and size.
    let opened = detail.open(path, build, &Overrides::default(), terminal)?;
    let compiled = &opened.compiled;
    if arguments.stats {
        terminal.write(&stats(compiled));
    }
    if let Some(target) = target {
        let failed = |error| Failure::Input(format!("{}: {error}", path.display()));
        return translate(compiled, target).map_err(failed);
    }
    Ok(match stage {
        Stage::Graph => compiled.graph.dump().into_bytes(),
        Stage::Bytecode => file::encode_file(&compiled.module),
        Stage::Asm => assembly(&opened).into_bytes(),
        _ => compiled.optimized.dump().into_bytes(),
    })
}

/// The syntax tree of a text.
fn tree(path: &Path, terminal: &Terminal) -> Result<String, Failure> {
    let Content::Text(text) = scene::read(path)? else {
        return Err(no_text(path, "syntax tree"));
    };
    let mut sources = Sources::new();
    let file = sources.add(path.display().to_string(), text);
    let (tree, found) = sdfc_lang::parse(&sources, file);
    terminal.diagnostics(&Diagnostics::from_iter(found), &sources);
    tree.map(|tree| sdfc_lang::dump(&tree))
        .ok_or(Failure::Told(INPUT))
}

fn elaborated(path: &Path, build: &Build) -> Result<Outcome<Scene>, Failure> {
    match scene::read(path)? {
        Content::Text(text) => scene::elaborated(path, text, build),
        Content::Clauses(text) => scene::clauses(path, text, build),
        Content::Bytecode(_) => Err(no_text(path, "scene")),
    }
}

fn no_text(path: &Path, what: &str) -> Failure {
    Failure::Input(format!(
        "{} is compiled already and has no {what}",
        path.display()
    ))
}

/// What the passes did, and what the programs take.
fn stats(compiled: &Compiled) -> String {
    let mut text = format!("lowered   {} nodes\n", compiled.graph.len());
    for pass in &compiled.passes {
        let _ = match pass.nodes {
            Some([before, after]) => {
                let change = match after.cmp(&before) {
                    Ordering::Less => format!("{} fewer", before - after),
                    Ordering::Equal => "as many as before".to_owned(),
                    Ordering::Greater => format!("{} more", after - before),
                };
                let notes: String = pass.notes.iter().map(|note| format!("; {note}")).collect();
                writeln!(text, "{:<9} {after} nodes, {change}{notes}", pass.name)
            }
            None => writeln!(text, "{:<9} left out", pass.name),
        };
    }
    let module = &compiled.module;
    let programs = [Some(&module.distance), module.surface.as_ref()];
    for (name, program) in ["distance", "surface"].into_iter().zip(programs) {
        if let Some(program) = program {
            let needs = program.needs();
            let _ = writeln!(
                text,
                "{name:<9} {} instructions, {} constants, {} values deep, {} slots, {} opcodes",
                program.code.len(),
                program.pool.len() * 4,
                needs.depth,
                needs.slots,
                needs.codes.len()
            );
        }
    }
    text
}

/// The programs as listings.
fn assembly(opened: &scene::Opened) -> String {
    let module = opened.module();
    let mut text = listing::print(&module.distance);
    if let Some(surface) = &module.surface {
        text.push_str("\n; with materials\n");
        text.push_str(&listing::print(surface));
    }
    text
}
