use crate::corpus::{compiled_scene, scene};
use sdfc_runtime::engine::{EngineKind, Loaded, open};
use sdfc_runtime::reference::Camera;
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_shaders::{assemble::SceneSource, camera, marching};
use sdfc_vm::vector::V3;
#[test]
fn debugray() {
    let path = std::env::var("RAY_SCENE").unwrap();
    let [x, y] = { let v: Vec<f64> = std::env::var("RAY_PIXEL").unwrap().split(',').map(|v| v.parse().unwrap()).collect(); [v[0], v[1]] };
    let mut compiled = compiled_scene(scene(std::path::Path::new(&path)));
    let outputs = compiled.module.update(0.0);
    let settings = resolve(&compiled.module, &outputs, &Overrides { size: Some([96, 72]), aa: Some(1), ..Overrides::default() }).unwrap();
    let cam = Camera::of(&settings);
    let ray = cam.ray([x, y], [0.0; 2]);
    let mut engine = open(EngineKind::Cpu).unwrap();
    engine.load(&Loaded { module: &compiled.module, outputs: &outputs, generated: SceneSource::default() }).unwrap();
    let o = ray.origin.map(|v| v as f32); let d = ray.direction.map(|v| v as f32);
    let (o, d) = (V3::of(o[0], o[1], o[2]), V3::of(d[0], d[1], d[2]));
    let b = compiled.module.settings.bounds;
    println!("{:?} {:?} {:?} far {} bounds {b:?} raw {} bound {}", settings.view, ray.origin, ray.direction, settings.far, compiled.module.distance.is_raw(), compiled.module.distance.is_bound());
    let largest = [b.min, b.max].concat().iter().filter(|v| v.is_finite()).fold(0.0_f64, |m, v| m.max(v.abs()));
    let start = ray.origin.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let rounding = (marching::ROUNDING * (largest.min(1e9) + start)) as f32;
    let raw = if compiled.module.distance.is_raw() { 1.0 } else { 0.0 };
    let (mut t, mut radius, mut step, mut trend, mut t_before, mut radius_before) = (std::env::var("RAY_T").ok().and_then(|v| v.parse().ok()).unwrap_or(0.0f32), 0.0f32, 0.0f32, -1.0f32, 0.0f32, 0.0f32);
    let steps: usize = std::env::var("RAY_STEPS").ok().and_then(|v| v.parse().ok()).unwrap_or(60);
    for n in 1..=steps {
        let p = camera::along::<f32>(o, d, t + step);
        let field = engine.query(&[[p.x, p.y, p.z]]).unwrap()[0].distance;
        let half = cam.half_pixel(f64::from(t + step)) as f32;
        let r = marching::rounding_at(t + step, rounding);
        let thr = marching::threshold(t + step, half, 0.05, rounding);
        let next = marching::march_step(t, radius, step, trend, t_before, radius_before, field, n as f32, thr, half, 0.3, r, raw, 1e9);
        let g = engine.query(&[[p.x, p.y, p.z]]).unwrap()[0].gradient; println!("grad {g:?}"); println!("{n} at {} field {field} noise {} thr {thr} half {half} -> t {} radius {} step {} trend {} arrived {}", t + step, marching::noise(r, 1.0, raw), next.t, next.radius, next.step, next.trend, next.arrived);
        (t, radius, step, trend, t_before, radius_before) = (next.t, next.radius, next.step, next.trend, next.t_before, next.radius_before);
        if next.arrived > 0.0 { break; }
    }
}
