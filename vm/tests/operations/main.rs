//! The operations of the table, each against a reference that does not share its code. References are
//! membership by a shape's definition, closed forms, the standard library's `f64`, differences.

mod affine;
mod blends;
mod bounds;
mod branching;
mod combining;
mod definitions;
mod distances;
mod elementary;
mod extremes;
mod facts;
mod fixture;
mod in_lanes;
mod moving;
mod noise;
mod numbers;
mod outline;
mod precise;
mod published;
mod recorded;
mod rounding;
mod slack;
mod slopes;
mod table;
