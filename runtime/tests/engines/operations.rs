//! Every operation of the table, in the interpreter and on the CPU.

use crate::scenes::{cpu, loaded, module_of, strict_interp};
use sdfc_vm::blend::BlendKernel;
use sdfc_vm::pool::{PoolBuilder, PoolNumber};
use sdfc_vm::program::{Destination, Instruction, Opcode, Program};
use sdfc_vm::row::Output;
use sdfc_vm::table::{Op, ROWS};
use sdfc_vm::verify::verify;

/// A program that runs these operations one after another and unites their results.
fn program(ops: &[Op]) -> Program {
    let mut pool = PoolBuilder::default();
    let hard = pool.add(&[1.0, 1.0, 0.0, 0.0].map(PoolNumber::from));
    let mut code: Vec<Instruction> = Vec::new();
    let mut any = false;
    let push = |code: &mut Vec<Instruction>, pool: &mut PoolBuilder, op: Op, base: f32| {
        let mut i = Instruction::new(Opcode::Op(op));
        let width = op.row().parameter_width();
        if width > 0 {
            // Different numbers of about one half, valid for most parameters.
            let numbers: Vec<PoolNumber> = (0..width)
                .map(|n| (base + 0.0625 * n as f32).into())
                .collect();
            i.parameters = pool.add(&numbers);
        }
        code.push(i);
    };
    for &op in ops {
        for operand in 0..op.row().arity() {
            push(
                &mut code,
                &mut pool,
                Op::Sphere,
                0.25 + 0.25 * operand as f32,
            );
        }
        push(&mut code, &mut pool, op, 0.4375);
        if op.row().output == Output::Point {
            push(&mut code, &mut pool, Op::Cuboid, 0.5);
        }
        if any {
            let mut unite = Instruction::new(Opcode::Top);
            unite.destination = Destination::Blend {
                kernel: BlendKernel::Hard,
                index: hard,
            };
            code.push(unite);
        }
        any = true;
    }
    let (pool, patches) = pool.finish();
    let program = Program {
        code,
        pool,
        patches,
        slots: 0,
    };
    verify(&program, 0, false).unwrap_or_else(|error| panic!("{error}: {ops:?}"));
    program
}

#[test]
fn every_operation_gives_the_same_values_and_gradients() {
    let Some(mut interp) = strict_interp() else {
        return;
    };
    let mut cpu = cpu();
    let ops: Vec<Op> = ROWS.iter().map(|row| row.op).collect();
    let coordinate = |i: usize, k: usize| ((i * k) % 97) as f32 / 32.0 - 1.5;
    let points: Vec<[f32; 3]> = (0..128)
        .map(|i| [coordinate(i, 5), coordinate(i, 29), coordinate(i, 61)])
        .collect();

    // A kernel with all operations; each operation is then run alone.
    let all_operations = module_of(program(&ops), None);
    interp
        .load(&loaded(&all_operations, &[]))
        .expect("it loads");
    interp.query(&points[..1]).expect("it runs");
    let pipelines = interp.pipelines_created();

    let mut wrong = Vec::new();
    for &op in &ops {
        let scene = module_of(program(&[op]), None);
        for engine in [&mut cpu, &mut interp] {
            engine.load(&loaded(&scene, &[])).expect("it loads");
        }
        let expected = cpu.query(&points).expect("the CPU answers");
        let samples = interp.query(&points).expect("the device answers");
        let close = |a: f32, b: f32, share: f32| {
            (a - b).abs() <= share * (1.0 + a.abs()) || a == b || (!a.is_finite() && !b.is_finite())
        };
        let differs = points
            .iter()
            .zip(expected.iter().zip(&samples))
            .find(|(_, (a, b))| {
                let gradients = a.gradient.iter().zip(b.gradient);
                !close(a.distance, b.distance, 4e-6)
                    || gradients.into_iter().any(|(&a, b)| !close(a, b, 2e-4))
            });
        if let Some((p, (a, b))) = differs {
            wrong.push(format!(
                "{}: at {p:?} cpu {} {:?}, interp {} {:?}",
                op.row().name,
                a.distance,
                a.gradient,
                b.distance,
                b.gradient
            ));
        }
    }
    assert_eq!(
        interp.pipelines_created(),
        pipelines,
        "no operation needs a kernel of its own"
    );
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
