//! Mixtures of Gaussians in three dimensions with full covariance, fitted by expectation and
//! maximisation from a k-means++ start.

use nalgebra::{Cholesky, Matrix3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::exponential::exp_of_negative;
use super::instructions::{InstructionSet, Kernel};

/// Expectation-maximisation stops when the mean log-likelihood gains less than this.
const CONVERGENCE: f64 = 1e-4;

/// … or after this many rounds.
const MAX_ROUNDS: usize = 100;

/// Rounds of Lloyd's k-means between the k-means++ seeds and the first expectation.
const KMEANS_ROUNDS: usize = 5;

/// Samples that are worked on at a time, with the shares of all Gaussians in them: several thousand
/// values, enough to be worth a thread's while.
const BLOCK: usize = 512;

/// Samples a component must have on average: a full covariance has six entries, and ten samples an
/// entry keep it from describing single pixels.
const SAMPLES_A_COMPONENT: usize = 60;

/// One Gaussian of a mixture.
#[derive(Clone, Debug, PartialEq)]
struct Gaussian {
    mean: Vector3<f64>,
    /// Inverse of the lower Cholesky factor of the covariance.
    whitening: Matrix3<f64>,
    /// Logarithm of weight times normalisation.
    log_scale: f64,
}

/// A mixture of Gaussians: Σ weight · N(mean, covariance).
#[derive(Clone, Debug, PartialEq)]
pub struct Mixture {
    gaussians: Vec<Gaussian>,
    mean_log_likelihood: f64,
    samples: usize,
}

/// How mixtures are fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MixtureSettings {
    /// Seed of the k-means++ start.
    pub seed: u64,
    /// Added to the diagonal of every covariance, in squared units of the samples: the width below
    /// which differences are noise.
    pub variance_floor: f64,
}

impl Mixture {
    /// Fits `components` Gaussians; fewer when the samples are too few for as many (60 samples a
    /// component). `None` with fewer than two samples.
    #[must_use]
    pub fn fit(
        samples: &[Vector3<f64>],
        components: usize,
        settings: MixtureSettings,
    ) -> Option<Self> {
        if samples.len() < 2 {
            return None;
        }
        let components = components.clamp(1, (samples.len() / SAMPLES_A_COMPONENT).max(1));
        let mut shares = Shares::hard(&kmeans(samples, components, settings.seed), components);
        let mut mixture = maximise(samples, &shares, settings.variance_floor);
        let axes = axes(samples);
        for _ in 0..MAX_ROUNDS {
            let before = mixture.mean_log_likelihood;
            let mean = mixture.expect(&axes, &mut shares);
            mixture = maximise(samples, &shares, settings.variance_floor);
            mixture.mean_log_likelihood = mean;
            if mean - before < CONVERGENCE && before.is_finite() {
                break;
            }
        }
        let densities: Vec<f64> = samples.par_iter().map(|x| mixture.log_density(x)).collect();
        mixture.mean_log_likelihood = densities.iter().sum::<f64>() / samples.len() as f64;
        Some(mixture)
    }

    /// Fits 1 to `most` components and keeps the number with the smallest Bayesian information
    /// criterion (Schwarz 1978): −2 ln L + p ln n, with p = 10k − 1 free parameters. Ties go to the
    /// fewer. `None` with fewer than two samples.
    #[must_use]
    pub fn fit_by_bic(
        samples: &[Vector3<f64>],
        most: usize,
        settings: MixtureSettings,
    ) -> Option<Self> {
        let fits: Vec<Self> = (1..=most.max(1))
            .into_par_iter()
            .filter_map(|k| Self::fit(samples, k, settings))
            .collect();
        fits.into_iter().min_by(|a, b| a.bic().total_cmp(&b.bic()))
    }

    /// Number of Gaussians.
    #[must_use]
    pub fn components(&self) -> usize {
        self.gaussians.len()
    }

    /// The Bayesian information criterion of the fit; smaller is better.
    #[must_use]
    pub fn bic(&self) -> f64 {
        let n = self.samples as f64;
        let parameters = (10 * self.components() - 1) as f64;
        -2.0 * self.mean_log_likelihood * n + parameters * n.ln()
    }

    /// Natural logarithm of the density at `x`, by log-sum-exp.
    #[must_use]
    pub fn log_density(&self, x: &Vector3<f64>) -> f64 {
        let mut largest = f64::NEG_INFINITY;
        let mut sum = 0.0;
        for gaussian in &self.gaussians {
            let term = gaussian.log_term(x);
            if term > largest {
                sum = sum * (largest - term).exp() + 1.0;
                largest = term;
            } else if term > f64::NEG_INFINITY {
                sum += (term - largest).exp();
            }
        }
        largest + sum.ln()
    }

    /// Fills `shares` with each Gaussian's share of each sample and returns the mean log-likelihood.
    fn expect(&self, samples: &Axes, shares: &mut Shares) -> f64 {
        let count = samples[0].len();
        let mut logs = vec![0.0; count];
        let instructions = InstructionSet::best();
        (logs.par_chunks_mut(BLOCK)).zip(shares.blocks.par_iter_mut()).enumerate().for_each(
            |(at, (logs, block))| {
                let here = at * BLOCK..at * BLOCK + logs.len();
                let samples = samples.each_ref().map(|axis| &axis[here.clone()]);
                instructions.run(Expectation { mixture: self, samples, block, logs });
            },
        );
        // In order of the samples, so that it is the same for any number of threads.
        let mut total = 0.0;
        for log in &logs {
            total += log;
        }
        total / count as f64
    }

    /// The same for one block; `logs` becomes the log-likelihood of each sample.
    #[inline(always)]
    fn expect_block(&self, samples: [&[f64]; 3], block: &mut Block, logs: &mut [f64]) {
        let mut largest = [f64::NEG_INFINITY; BLOCK];
        for (column, gaussian) in block.iter_mut().zip(&self.gaussians) {
            gaussian.log_terms(samples, column);
            for (largest, term) in largest.iter_mut().zip(column.iter()) {
                // No term is a NaN, and the plain comparison is the faster.
                *largest = if *term > *largest { *term } else { *largest };
            }
        }
        let mut sums = [0.0; BLOCK];
        for column in block.iter_mut() {
            for ((term, largest), sum) in column.iter_mut().zip(&largest).zip(&mut sums) {
                *term = exp_of_negative(*term - largest);
                *sum += *term;
            }
        }
        for column in block.iter_mut() {
            column.iter_mut().zip(&sums).for_each(|(share, sum)| *share /= sum);
        }
        for ((log, largest), sum) in logs.iter_mut().zip(&largest).zip(&sums) {
            *log = largest + sum.ln();
        }
    }
}

/// The coordinates of all samples, an axis after the other.
type Axes = [Vec<f64>; 3];

fn axes(samples: &[Vector3<f64>]) -> Axes {
    std::array::from_fn(|axis| samples.iter().map(|x| x[axis]).collect())
}

/// The shares of a block of samples to be worked out.
struct Expectation<'a> {
    mixture: &'a Mixture,
    samples: [&'a [f64]; 3],
    block: &'a mut Block,
    logs: &'a mut [f64],
}

impl Kernel for Expectation<'_> {
    type Result = ();

    #[inline(always)]
    fn run(self) {
        self.mixture.expect_block(self.samples, self.block, self.logs);
    }
}

/// The shares of a block of samples, a column a Gaussian.
type Block = Vec<Vec<f64>>;

/// Each Gaussian's share of each sample.
struct Shares {
    blocks: Vec<Block>,
}

impl Shares {
    /// All of each sample to the Gaussian of its label.
    fn hard(labels: &[usize], k: usize) -> Self {
        let share = |label: usize, c: usize| if label == c { 1.0 } else { 0.0 };
        let column = |labels: &[usize], c: usize| labels.iter().map(|l| share(*l, c)).collect();
        let block = |labels: &[usize]| (0..k).map(|c| column(labels, c)).collect();
        Self { blocks: labels.chunks(BLOCK).map(block).collect() }
    }

    fn components(&self) -> usize {
        self.blocks.first().map_or(0, Vec::len)
    }

    /// The samples with Gaussian `c`'s share of each.
    fn of<'a>(
        &'a self,
        c: usize,
        samples: &'a [Vector3<f64>],
    ) -> impl Iterator<Item = (&'a Vector3<f64>, f64)> {
        let columns = self.blocks.iter().map(move |block| &block[c]);
        samples
            .chunks(BLOCK)
            .zip(columns)
            .flat_map(|(xs, shares)| xs.iter().zip(shares.iter().copied()))
    }
}

impl Gaussian {
    /// `None` when the covariance is not positive definite (never with a positive floor).
    fn new(mean: Vector3<f64>, covariance: Matrix3<f64>, weight: f64) -> Option<Self> {
        let lower = Cholesky::new(covariance)?.l();
        let whitening = lower.try_inverse()?;
        let log_determinant: f64 = 2.0 * (0..3).map(|i| lower[(i, i)].ln()).sum::<f64>();
        let log_scale = weight.ln() - 0.5 * (log_determinant + 3.0 * std::f64::consts::TAU.ln());
        Some(Self { mean, whitening, log_scale })
    }

    fn log_term(&self, x: &Vector3<f64>) -> f64 {
        self.log_scale - 0.5 * (self.whitening * (x - self.mean)).norm_squared()
    }

    /// The same of several samples, by their coordinates; the whitening is a lower triangle.
    #[inline(always)]
    fn log_terms(&self, [xs, ys, zs]: [&[f64]; 3], terms: &mut [f64]) {
        let m = &self.whitening;
        for ((term, x), (y, z)) in terms.iter_mut().zip(xs).zip(ys.iter().zip(zs)) {
            let (x, y, z) = (x - self.mean[0], y - self.mean[1], z - self.mean[2]);
            let a = m[(0, 0)] * x;
            let b = m[(1, 0)] * x + m[(1, 1)] * y;
            let c = m[(2, 0)] * x + m[(2, 1)] * y + m[(2, 2)] * z;
            *term = self.log_scale - 0.5 * (a * a + b * b + c * c);
        }
    }
}

/// Weights, means and covariances from shares. A Gaussian that has lost its samples is dropped by
/// its weight of nearly nothing, not removed: the number of components stays as asked.
fn maximise(samples: &[Vector3<f64>], shares: &Shares, floor: f64) -> Mixture {
    let gaussian = |c: usize| {
        // Each sum in order of the samples; several at once, since one alone waits for itself.
        let (mut mass, mut sum) = (0.0, [0.0; 3]);
        shares.of(c, samples).for_each(|(x, share)| {
            mass += share;
            for (sum, x) in sum.iter_mut().zip(x.as_slice()) {
                *sum += x * share;
            }
        });
        let mass = f64::max(mass, 1e-9);
        let mean = Vector3::from(sum) / mass;
        let (mut squares, mut products) = ([0.0; 3], [0.0; 3]);
        shares.of(c, samples).for_each(|(x, share)| {
            let d = x - mean;
            for i in 0..3 {
                squares[i] += d[i] * d[i] * share;
                products[i] += d[i] * d[(i + 1) % 3] * share;
            }
        });
        let ([xx, yy, zz], [xy, yz, zx]) = (squares, products);
        let scatter = Matrix3::new(xx, xy, zx, xy, yy, yz, zx, yz, zz);
        let covariance = scatter / mass + Matrix3::identity() * floor.max(1e-9);
        Gaussian::new(mean, covariance, mass / samples.len() as f64)
    };
    let gaussians: Vec<Option<Gaussian>> =
        (0..shares.components()).into_par_iter().map(gaussian).collect();
    Mixture {
        gaussians: gaussians.into_iter().flatten().collect(),
        mean_log_likelihood: f64::NEG_INFINITY,
        samples: samples.len(),
    }
}

/// Labels after a few rounds of k-means from k-means++ seeds (Arthur and Vassilvitskii 2007).
fn kmeans(samples: &[Vector3<f64>], k: usize, seed: u64) -> Vec<usize> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut centres = vec![samples[rng.random_range(0..samples.len())]];
    let mut nearest_sq: Vec<f64> = vec![f64::INFINITY; samples.len()];
    while centres.len() < k {
        let newest = centres[centres.len() - 1];
        for (d, x) in nearest_sq.iter_mut().zip(samples) {
            *d = d.min((x - newest).norm_squared());
        }
        let total: f64 = nearest_sq.iter().sum();
        let mut target = rng.random_range(0.0..1.0) * total;
        let chosen = nearest_sq.iter().position(|d| {
            target -= d;
            target < 0.0
        });
        centres.push(samples[chosen.unwrap_or(samples.len() - 1)]);
    }
    let mut labels = assign(samples, &centres);
    for _ in 0..KMEANS_ROUNDS {
        for (c, centre) in centres.iter_mut().enumerate() {
            let own: Vec<&Vector3<f64>> =
                samples.iter().zip(&labels).filter(|(_, l)| **l == c).map(|(x, _)| x).collect();
            if !own.is_empty() {
                *centre = own.iter().copied().sum::<Vector3<f64>>() / own.len() as f64;
            }
        }
        labels = assign(samples, &centres);
    }
    labels
}

fn assign(samples: &[Vector3<f64>], centres: &[Vector3<f64>]) -> Vec<usize> {
    let nearest = |x: &Vector3<f64>| {
        let distances = centres.iter().map(|centre| (x - centre).norm_squared()).enumerate();
        distances.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(centre, _)| centre)
    };
    samples.iter().map(nearest).collect()
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    const SETTINGS: MixtureSettings = MixtureSettings { seed: 42, variance_floor: 1e-4 };

    fn planted(counts: &[usize]) -> Vec<Vector3<f64>> {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let mut samples = Vec::new();
        for (c, &count) in counts.iter().enumerate() {
            let centre = Vector3::new(8.0 * c as f64, 3.0 * (c % 2) as f64, -5.0 * c as f64);
            for _ in 0..count {
                let (a, b, z) = (normal(), normal(), normal());
                samples.push(centre + Vector3::new(a, 0.8 * a + 0.3 * b, 0.5 * z));
            }
        }
        samples
    }

    #[test]
    fn the_criterion_finds_the_planted_number_and_their_weights() {
        let samples = planted(&[900, 600, 300]);
        let mixture = Mixture::fit_by_bic(&samples, 8, SETTINGS).unwrap();
        assert_eq!(mixture.components(), 3);
        let mut scales: Vec<Vector3<f64>> = mixture.gaussians.iter().map(|g| g.mean).collect();
        scales.sort_by(|a, b| a.x.total_cmp(&b.x));
        assert!((scales[1] - Vector3::new(8.0, 3.0, -5.0)).norm() < 0.2, "{scales:?}");
    }

    #[test]
    fn one_gaussian_has_the_textbook_density() {
        // With one component the fit is the sample mean and covariance in closed form.
        let samples = planted(&[500]);
        let mixture = Mixture::fit(&samples, 1, SETTINGS).unwrap();
        let n = samples.len() as f64;
        let mean: Vector3<f64> = samples.iter().sum::<Vector3<f64>>() / n;
        let covariance: Matrix3<f64> =
            samples.iter().map(|x| (x - mean) * (x - mean).transpose()).sum::<Matrix3<f64>>() / n
                + Matrix3::identity() * 1e-4;
        let x = Vector3::new(0.3, -0.2, 0.9);
        let distance = ((x - mean).transpose() * covariance.try_inverse().unwrap() * (x - mean))[0];
        let expected =
            -0.5 * (distance + covariance.determinant().ln() + 3.0 * std::f64::consts::TAU.ln());
        assert!((mixture.log_density(&x) - expected).abs() < 1e-9);
    }

    #[test]
    fn the_likelihood_never_falls_from_round_to_round() {
        let samples = planted(&[300, 300]);
        let mut shares = Shares::hard(&kmeans(&samples, 4, 1), 4);
        let mut mixture = maximise(&samples, &shares, 0.0);
        let mut before = f64::NEG_INFINITY;
        for _ in 0..30 {
            let mean = mixture.expect(&axes(&samples), &mut shares);
            assert!(mean >= before - 1e-9, "{mean} after {before}");
            before = mean;
            mixture = maximise(&samples, &shares, 0.0);
        }
    }

    /// One round, sample by sample and sum by sum, as the textbook writes it.
    fn plain_round(mixture: &Mixture, samples: &[Vector3<f64>]) -> (f64, Vec<Gaussian>) {
        let k = mixture.components();
        let mut total = 0.0;
        let mut shares = Vec::new();
        for x in samples {
            let terms: Vec<f64> = mixture.gaussians.iter().map(|g| g.log_term(x)).collect();
            let largest = terms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let sum: f64 = terms.iter().map(|t| exp_of_negative(t - largest)).sum();
            shares.extend(terms.iter().map(|t| exp_of_negative(t - largest) / sum));
            total += largest + sum.ln();
        }
        let gaussian = |c: usize| {
            let share = |t: usize| shares[t * k + c];
            let mass: f64 = (0..samples.len()).map(share).sum::<f64>().max(1e-9);
            let weighted = |(t, x): (usize, &Vector3<f64>)| x * share(t);
            let mean = samples.iter().enumerate().map(weighted).sum::<Vector3<f64>>() / mass;
            let scatter =
                |(t, x): (usize, &Vector3<f64>)| (x - mean) * (x - mean).transpose() * share(t);
            let scatter: Matrix3<f64> = samples.iter().enumerate().map(scatter).sum();
            let covariance = scatter / mass + Matrix3::identity() * 1e-4;
            Gaussian::new(mean, covariance, mass / samples.len() as f64)
        };
        (total / samples.len() as f64, (0..k).filter_map(gaussian).collect())
    }

    #[test]
    fn a_round_is_the_textbooks_to_the_bit() {
        let samples = planted(&[700, 500, 217]);
        let k = 5;
        let mut shares = Shares::hard(&kmeans(&samples, k, 3), k);
        let mut mixture = maximise(&samples, &shares, 1e-4);
        for _ in 0..20 {
            let (wanted_mean, wanted) = plain_round(&mixture, &samples);
            let mean = mixture.expect(&axes(&samples), &mut shares);
            mixture = maximise(&samples, &shares, 1e-4);
            assert_eq!(mean.to_bits(), wanted_mean.to_bits());
            assert_eq!(mixture.gaussians, wanted);
        }
    }

    #[test]
    fn flat_colour_and_tiny_samples_do_not_break_it() {
        let flat = vec![Vector3::new(10.0, 10.0, 10.0); 400];
        let mixture = Mixture::fit_by_bic(&flat, 8, SETTINGS).unwrap();
        assert!(mixture.log_density(&flat[0]).is_finite());
        assert!(Mixture::fit(&flat[..1], 1, SETTINGS).is_none());
        assert_eq!(Mixture::fit(&flat[..5], 8, SETTINGS).unwrap().components(), 1);
    }
}
