use super::*;
#[test]
fn timing() {
    let get = |k: &str, d: f64| std::env::var(k).ok().and_then(|s| s.parse().ok()).unwrap_or(d);
    let (n, m) = (get("N", 100.0) as usize, get("M", 4.0) as usize);
    let period = get("T", 12.15);
    let noise = get("NOISE", 0.15);
    let mut rng =
        <rand_chacha::ChaCha8Rng as rand::SeedableRng>::seed_from_u64(get("SEED", 1.0) as u64);
    use rand_distr::{Distribution, StandardNormal};
    let mut g = || -> f64 { StandardNormal.sample(&mut rng) };
    let cols: Vec<f64> = (0..n)
        .flat_map(|t| {
            let a = t as f64 / period * std::f64::consts::TAU;
            let (x, y) = (a.cos() * 2f64.sqrt() + noise * g(), a.sin() * 2f64.sqrt() + noise * g());
            [x, y]
        })
        .collect();
    let c = Coefficients::from_rows(n, 2, cols).unwrap();
    let t = Instant::now();
    let s = KeySettings { keys: m, time_limit_s: get("LIMIT", 60.0), ..Default::default() };
    let r = choose_keys(&c, &s, &|_, _| true).unwrap();
    eprintln!("n {n} m {m}: {:?} {r:?}", t.elapsed());
}
