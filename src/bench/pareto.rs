//! The Pareto front: the settings that no other one dominates in cost and error.

/// Reports which of these pairs of cost and error are on the front. No other pair then has at most the same
/// cost and error, and less of one of both. A pair with NaN is on no front.
pub(crate) fn pareto_front(pairs: &[(f64, f64)]) -> Vec<bool> {
    let dominates =
        |a: &(f64, f64), b: &(f64, f64)| a.0 <= b.0 && a.1 <= b.1 && (a.0 < b.0 || a.1 < b.1);
    let is_number = |pair: &(f64, f64)| !pair.0.is_nan() && !pair.1.is_nan();
    let is_on_front = |pair| is_number(pair) && !pairs.iter().any(|other| dominates(other, pair));
    pairs.iter().map(is_on_front).collect()
}

#[cfg(test)]
mod tests {
    use super::pareto_front;
    use sdfc_trials::random::Random;

    #[test]
    fn only_what_is_beaten_is_left_out() {
        let pairs = [
            (1.0, 9.0),
            (2.0, 4.0),
            (2.0, 5.0),
            (3.0, 4.0),
            (4.0, 1.0),
            (4.0, 1.0),
            (9.0, 2.0),
            (f64::NAN, 0.0),
        ];
        let expected = [true, true, false, false, true, true, false, false];
        assert_eq!(pareto_front(&pairs), expected);
        assert!(pareto_front(&[]).is_empty());
    }

    /// From left to right along a front, errors only become smaller.
    #[test]
    fn a_front_goes_down() {
        let mut random = Random::for_case("front");
        let mut next = || random.below(40) as f64;
        let pairs: Vec<(f64, f64)> = (0..200).map(|_| (next(), next())).collect();
        let is_on_front = pareto_front(&pairs);
        let mut kept: Vec<_> = pairs
            .iter()
            .zip(&is_on_front)
            .filter(|(_, on)| **on)
            .collect();
        kept.sort_by(|a, b| a.0.0.total_cmp(&b.0.0));
        for pair in kept.windows(2) {
            let ((a, _), (b, _)) = (pair[0], pair[1]);
            assert!(b.1 < a.1 || a == b, "{a:?} then {b:?}");
        }
        for (pair, on) in pairs.iter().zip(&is_on_front) {
            let reached = kept.iter().any(|(k, _)| k.0 <= pair.0 && k.1 <= pair.1);
            assert!(
                *on || reached,
                "{pair:?} is neither on the front nor beaten by it"
            );
        }
    }
}
