//! Scenes from bytecode. It holds the program and the inputs of its constants, so live params can be
//! changed. Structural params cannot.

use super::{CompiledScene, OpenResult, Request};
use crate::elaborate::{self, elaborate};
use crate::raise;
use sdfc_lang::Sources;
use sdfc_vm::program::Module;
use sdfc_vm::settings::{Param, ParamKind};

/// Opens a module with the requested params, and raises its graphs.
pub(super) fn open_module(
    mut module: Module,
    request: &Request<'_>,
) -> Result<OpenResult<CompiledScene>, String> {
    let path = request.path.display();
    let compiled_already = |what: &str| {
        Err(format!(
            "{path} is compiled already: {what} needs the scene's text"
        ))
    };
    if request.part.is_some() {
        return compiled_already("`--part`");
    }
    if request.passes.disable_all || !request.passes.disabled.is_empty() {
        return compiled_already("leaving out passes");
    }
    if request.lod_target.is_some() {
        return compiled_already("`--lod`");
    }
    let overrides = request.overrides.clone();
    let structural =
        module.settings.params.iter().find(|param| {
            param.structural && overrides.iter().any(|(name, _)| *name == param.name)
        });
    if let Some(param) = structural {
        return compiled_already(&format!(
            "`{}` decides its structure, and changing it",
            param.name
        ));
    }
    // The params are declared once more in the language, which parses values, checks ranges and reports
    // errors.
    let mut sources = Sources::new();
    let declared: String = module.settings.params.iter().map(declaration).collect();
    let file = sources.add(path.to_string(), declared);
    let options = elaborate::Options {
        overrides,
        time: request.time,
        loader: &elaborate::NoFiles,
    };
    let (scene, diagnostics) = elaborate(&mut sources, file, &options);
    let diagnostics = diagnostics
        .into_iter()
        .filter(|diagnostic| diagnostic.is_error())
        .collect();
    let compiled = scene.map(|scene| {
        for (param, new) in module.settings.params.iter_mut().zip(scene.params) {
            param.value = new.value;
        }
        CompiledScene::new(raise::raise(module), Vec::new(), request.time)
    });
    Ok(OpenResult {
        sources,
        diagnostics,
        value: compiled,
    })
}

/// Returns a param as a scene declares it.
fn declaration(param: &Param) -> String {
    let (ty, unit) = match param.kind {
        ParamKind::Float => ("float", ""),
        ParamKind::Int => ("int", ""),
        ParamKind::Bool => ("bool", ""),
        ParamKind::Length => ("length", ""),
        ParamKind::Angle => ("angle", "rad"),
        ParamKind::Time => ("time", "s"),
        ParamKind::Color => ("color", ""),
        ParamKind::Vec2 => ("vec2", ""),
        ParamKind::Vec3 => ("vec3", ""),
    };
    let number = |value: &f64| format!("{value}{unit}");
    let value = match (param.kind, param.value.as_slice()) {
        (ParamKind::Bool, [value]) => (*value != 0.0).to_string(),
        (ParamKind::Color, [r, g, b]) => format!("rgb({r}, {g}, {b})"),
        (_, [value]) => number(value),
        (_, values) => format!(
            "[{}]",
            values.iter().map(number).collect::<Vec<_>>().join(", ")
        ),
    };
    let range = param.range.map_or(String::new(), |(low, high)| {
        let dots = if param.inclusive { "..=" } else { ".." };
        format!(" in {}{dots}{}", number(&low), number(&high))
    });
    format!(
        "param {}: {ty} = {value}{range};\n",
        param.name.replace("::", "_")
    )
}
