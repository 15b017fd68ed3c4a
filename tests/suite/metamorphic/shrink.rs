//! Reduction of a failing scene to its smallest failing part.

use super::scene::{Body, Head, Shape};

impl Shape {
    /// Returns the shapes with one element removed.
    fn simpler(&self) -> Vec<Self> {
        let with = |children: &[Self], make: &dyn Fn(Vec<Self>) -> Self| {
            let mut candidates = children.to_vec();
            for (index, child) in children.iter().enumerate() {
                candidates.extend(child.simpler().into_iter().map(|simple| {
                    let mut children = children.to_vec();
                    children[index] = simple;
                    make(children)
                }));
            }
            candidates
        };
        match self {
            Self::Solid(_) | Self::Field { .. } => Vec::new(),
            Self::Union(parts) => {
                let mut candidates = with(parts, &Self::Union);
                for index in 0..parts.len() {
                    let mut fewer = parts.clone();
                    fewer.remove(index);
                    candidates.push(Self::Union(fewer));
                }
                candidates.retain(|shape| !matches!(shape, Self::Union(parts) if parts.is_empty()));
                candidates
            }
            Self::Pair {
                pair,
                operator,
                reads_values,
            } => with(&pair[..], &|children| {
                let pair = children.try_into().expect("a pair stays one");
                Self::Pair {
                    pair: Box::new(pair),
                    operator: operator.clone(),
                    reads_values: *reads_values,
                }
            }),
            Self::Call {
                child,
                method,
                reads_values,
            } => with(std::slice::from_ref(child), &|mut children| Self::Call {
                child: Box::new(children.remove(0)),
                method: method.clone(),
                reads_values: *reads_values,
            }),
        }
    }
}

/// Returns the scenes with one element removed.
fn simpler(head: &Head, body: &Body) -> Vec<(Head, Body)> {
    let mut candidates = Vec::new();
    for (index, part) in body.parts.iter().enumerate() {
        if body.parts.len() > 1 {
            let mut fewer = body.clone();
            fewer.parts.remove(index);
            candidates.push((head.clone(), fewer));
        }
        for simple in part.simpler() {
            let mut body = body.clone();
            body.parts[index] = simple;
            candidates.push((head.clone(), body));
        }
    }
    for index in 0..head.lights.len() {
        let mut head = head.clone();
        head.lights.remove(index);
        candidates.push((head, body.clone()));
    }
    if head.fog.is_some() {
        let fog = None;
        candidates.push((
            Head {
                fog,
                ..head.clone()
            },
            body.clone(),
        ));
    }
    if head.occlusion != "off" {
        let occlusion = "off";
        candidates.push((
            Head {
                occlusion,
                ..head.clone()
            },
            body.clone(),
        ));
    }
    candidates
}

/// Maximum number of scenes tried. A campaign treats longer drawing as a hang.
const MAX_TRIALS: usize = 150;

/// Removes elements from a scene as long as it still fails.
pub(super) fn shrink(
    head: &Head,
    body: &Body,
    mut fails: impl FnMut(&Head, &Body) -> bool,
) -> (Head, Body) {
    let mut smallest = (head.clone(), body.clone());
    let mut trials = 0;
    let mut still_fails = |(head, body): &(Head, Body)| {
        trials += 1;
        trials <= MAX_TRIALS && fails(head, body)
    };
    while let Some(simpler_scene) = simpler(&smallest.0, &smallest.1)
        .into_iter()
        .find(&mut still_fails)
    {
        smallest = simpler_scene;
    }
    smallest
}
