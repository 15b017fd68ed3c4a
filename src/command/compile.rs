//! `sdfc compile`: the stages of compiling a scene.

use crate::failure::{Failure, INPUT};
use crate::output;
use crate::scene::{self, BuildArgs, LodArgs};
use crate::terminal::Terminal;
use clap::ValueEnum;
use sdfc_compiler::compile::Compiled;
use sdfc_compiler::dump::dump;
use sdfc_compiler::export::{Target, fidget_clauses, translate};
use sdfc_compiler::open::{OpenResult, SceneFile};
use sdfc_compiler::scene::Scene;
use sdfc_lang::{Diagnostics, Sources};
use sdfc_runtime::settings::Overrides;
use sdfc_vm::{file, listing};
use std::cmp::Ordering;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Print or write a stage of the compilation of a scene.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// The scene: .sdf, .sdfb or .vm; `-` is standard input.
    scene: PathBuf,
    /// The stage, or the language of an export.
    #[arg(long, value_enum, value_name = "STAGE", default_value = "asm")]
    emit: EmitStage,
    /// Output file; by default standard output.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Report on standard error the effect of each pass, and the size of the programs.
    #[arg(long)]
    stats: bool,
    #[command(flatten)]
    lod: LodArgs,
    #[command(flatten)]
    build: BuildArgs,
}

/// The stages of the compiler, in order, then the languages of exports.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum EmitStage {
    /// The syntax tree.
    Ast,
    /// The scene, with names, types and loops resolved.
    Scene,
    /// The graph of operations, each of them once.
    Graph,
    /// The graph after the optimizing passes.
    Optimized,
    /// A listing of the program.
    Asm,
    /// The program as a file that sdfc reads.
    Bytecode,
    /// The scene as functions in WGSL.
    Wgsl,
    /// The scene as functions in GLSL.
    Glsl,
    /// The scene as functions in HLSL.
    Hlsl,
    /// The scene as functions in Metal's language.
    Msl,
    /// The scene as functions in SPIR-V, which is binary.
    Spirv,
    /// A page for Shadertoy.
    Shadertoy,
    /// The field as clauses of Fidget and libfive, which sdfc reads as well.
    Vm,
}

impl EmitStage {
    fn is_text(self) -> bool {
        !matches!(self, Self::Bytecode | Self::Spirv)
    }
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<(), Failure> {
    let stage = arguments.emit;
    let bytes = emit(arguments, terminal)?;
    if let Some(to) = &arguments.output {
        let imported = arguments.build.imported();
        let inputs = imported.iter().chain([&arguments.scene]);
        output::check_differs(to, inputs.map(PathBuf::as_path))?;
    }
    output::deliver(arguments.output.as_deref(), &bytes, stage.is_text())
}

fn emit(arguments: &Arguments, terminal: &Terminal) -> Result<Vec<u8>, Failure> {
    let Arguments {
        scene: path,
        emit: stage,
        build,
        lod,
        ..
    } = arguments;
    let target = match stage {
        EmitStage::Ast => return Ok(syntax_tree(path, terminal)?.into_bytes()),
        EmitStage::Scene => {
            let scene = scene::report_and_unwrap(elaborate(path, build)?, terminal)?;
            return Ok(dump(&scene).into_bytes());
        }
        EmitStage::Graph
        | EmitStage::Optimized
        | EmitStage::Asm
        | EmitStage::Bytecode
        | EmitStage::Vm => None,
        EmitStage::Wgsl => Some(Target::Wgsl),
        EmitStage::Glsl => Some(Target::Glsl),
        EmitStage::Hlsl => Some(Target::Hlsl),
        EmitStage::Msl => Some(Target::Msl),
        EmitStage::Spirv => Some(Target::Spirv),
        EmitStage::Shadertoy => Some(Target::Shadertoy),
    };
    // For the scene's own camera and size.
    let opened = lod.open(path, build, &Overrides::default(), terminal)?;
    let compiled = &opened.compiled;
    if arguments.stats {
        terminal.write(&stats(compiled));
    }
    let failed = |error| Failure::Input(format!("{}: {error}", path.display()));
    if let Some(target) = target {
        return translate(compiled, target).map_err(failed);
    }
    Ok(match stage {
        EmitStage::Graph => compiled.graph.dump().into_bytes(),
        EmitStage::Bytecode => file::encode_file(&compiled.module),
        EmitStage::Asm => assembly(&opened).into_bytes(),
        EmitStage::Vm => fidget_clauses(compiled).map_err(failed)?.into_bytes(),
        _ => compiled.optimized.dump().into_bytes(),
    })
}

/// Returns the syntax tree of a text.
fn syntax_tree(path: &Path, terminal: &Terminal) -> Result<String, Failure> {
    let SceneFile::Text(text) = scene::read(path)? else {
        return Err(no_text_error(path, "syntax tree"));
    };
    let mut sources = Sources::new();
    let file = sources.add(path.display().to_string(), text);
    let (tree, diagnostics) = sdfc_lang::parse(&sources, file);
    terminal.diagnostics(&Diagnostics::from_iter(diagnostics), &sources);
    tree.map(|tree| sdfc_lang::dump(&tree))
        .ok_or(Failure::AlreadyReported(INPUT))
}

fn elaborate(path: &Path, build: &BuildArgs) -> Result<OpenResult<Scene>, Failure> {
    match scene::read(path)? {
        SceneFile::Text(text) => scene::elaborated(path, text, build),
        SceneFile::FidgetText(text) => scene::fidget_text(path, text, build),
        SceneFile::Bytecode(_) => Err(no_text_error(path, "scene")),
    }
}

fn no_text_error(path: &Path, missing: &str) -> Failure {
    Failure::Input(format!(
        "{} is compiled already and has no {missing}",
        path.display()
    ))
}

/// Describes the effects of the passes, and the size of the programs.
fn stats(compiled: &Compiled) -> String {
    let mut text = format!("lowered   {} nodes\n", compiled.graph.len());
    for pass in &compiled.passes {
        let _ = match pass.nodes {
            Some([before, after]) => {
                let change = match after.cmp(&before) {
                    Ordering::Less => format!("{} fewer", before - after),
                    Ordering::Equal => "the same number".to_owned(),
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
            let needs = program.requirements();
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

/// Returns listings of the programs.
fn assembly(opened: &scene::OpenedScene) -> String {
    let module = opened.module();
    let mut text = listing::print(&module.distance);
    if let Some(surface) = &module.surface {
        text.push_str("\n; with materials\n");
        text.push_str(&listing::print(surface));
    }
    text
}
