//! Gauss-Legendre rules and adaptive bisection for small vectors of integrals.

use core::f64::consts::PI;

/// A Gauss-Legendre rule on [0, 1].
#[derive(Clone, Debug)]
pub(crate) struct GaussLegendre {
    nodes: Vec<(f64, f64)>,
}

impl GaussLegendre {
    /// `order` nodes by Newton's method on the Legendre polynomial from Chebyshev guesses; exact for polynomials of degree
    /// 2 order − 1.
    pub(crate) fn new(order: u32) -> Self {
        let n = f64::from(order);
        let node = |k: u32| {
            let mut x = (PI * (f64::from(k) + 0.75) / (n + 0.5)).cos();
            let mut slope = 1.0;
            // Quadratic convergence from guesses good to 1e-2: the last bit is there after 5 steps.
            for _ in 0..6 {
                let (value, derivative) = legendre(order, x);
                slope = derivative;
                x -= value / derivative;
            }
            (0.5 * (1.0 - x), 1.0 / ((1.0 - x) * (1.0 + x) * slope * slope))
        };
        Self { nodes: (0..order).map(node).collect() }
    }

    /// (node, weight) on [0, 1], ascending; the weights sum to 1.
    pub(crate) fn unit(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.nodes.iter().copied()
    }

    fn over<const K: usize>(&self, f: &mut impl FnMut(f64) -> [f64; K], a: f64, b: f64) -> [f64; K] {
        let mut sum = [0.0; K];
        for (x, w) in &self.nodes {
            let value = f(a + (b - a) * x);
            for (s, v) in sum.iter_mut().zip(value) {
                *s += w * v;
            }
        }
        sum.map(|s| s * (b - a))
    }
}

/// The Legendre polynomial of this order and its derivative, |x| < 1.
fn legendre(order: u32, x: f64) -> (f64, f64) {
    let (mut before, mut value) = (0.0, 1.0);
    for k in 0..order {
        let k = f64::from(k);
        let next = ((2.0 * k + 1.0) * x * value - k * before) / (k + 1.0);
        before = value;
        value = next;
    }
    (value, f64::from(order) * (before - x * value) / ((1.0 - x) * (1.0 + x)))
}

/// A vector of integrals and the sum of the differences at which bisection stopped (of its worst component).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sum<const K: usize> {
    pub(crate) value: [f64; K],
    pub(crate) error: f64,
}

impl<const K: usize> Sum<K> {
    pub(crate) const ZERO: Self = Self { value: [0.0; K], error: 0.0 };

    pub(crate) fn add(&mut self, other: &Self) {
        for (s, v) in self.value.iter_mut().zip(other.value) {
            *s += v;
        }
        self.error += other.error;
    }
}

/// Bisects [a, b] until a panel and its two halves agree within `tolerance` (absolute), at most `limit` times.
///
/// The halves are kept, whose own error is smaller than the difference by orders of magnitude where f is smooth. A jump takes
/// some 40 bisections to 1e-13.
pub(crate) fn bisect<const K: usize>(
    rule: &GaussLegendre,
    f: &mut impl FnMut(f64) -> [f64; K],
    [a, b]: [f64; 2],
    tolerance: f64,
    limit: u32,
) -> Sum<K> {
    let mut total = Sum::ZERO;
    if b <= a {
        return total;
    }
    let mut left_over = limit;
    let mut open = vec![(a, b, rule.over(f, a, b))];
    while let Some((a, b, whole)) = open.pop() {
        let middle = 0.5 * (a + b);
        let (left, right) = (rule.over(f, a, middle), rule.over(f, middle, b));
        let mut halves = left;
        let mut difference: f64 = 0.0;
        for ((h, r), w) in halves.iter_mut().zip(right).zip(whole) {
            *h += r;
            difference = difference.max((*h - w).abs());
        }
        if difference <= tolerance || left_over == 0 {
            total.add(&Sum { value: halves, error: difference });
        } else {
            left_over -= 1;
            open.push((a, middle, left));
            open.push((middle, b, right));
        }
    }
    total
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rule_is_exact_to_degree_2n_minus_1() {
        let rule = GaussLegendre::new(10);
        for degree in 0..20 {
            let sum: f64 = rule.unit().map(|(x, w)| w * x.powi(degree)).sum();
            assert!((sum * f64::from(degree + 1) - 1.0).abs() < 1e-14, "degree {degree}: {sum}");
        }
    }

    #[test]
    fn bisection_finds_a_narrow_peak_and_says_when_it_cannot() {
        let rule = GaussLegendre::new(10);
        let width = 1e-5;
        let peak = |x: f64| [width / (x * x + width * width)];
        let found = bisect(&rule, &mut { peak }, [0.0, 1.0], 1e-13, 100);
        assert!((found.value[0] - (1.0 / width).atan()).abs() < 1e-12, "{found:?}");
        let given_up = bisect(&rule, &mut { peak }, [0.0, 1.0], 1e-13, 3);
        let miss = (given_up.value[0] - (1.0 / width).atan()).abs();
        assert!(miss > 1.0 && given_up.error > 1e11 * 1e-13, "{given_up:?}");
    }
}
