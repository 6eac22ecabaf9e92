/// Two numbers s, z > 0 whose product must vanish.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Pair {
    pub s: f64,
    pub z: f64,
    pub ds: f64,
    pub dz: f64,
    /// Right-hand side of `s dz + z ds = right`.
    pub right: f64,
}

impl Pair {
    pub fn new(s: f64, z: f64) -> Self {
        Self { s, z, ..Self::default() }
    }

    pub fn gap(&self) -> f64 {
        self.s * self.z
    }

    /// Targets s z = 0.
    pub fn aim_affine(&mut self) {
        self.right = -self.s * self.z;
    }

    /// Targets s z = mu, with Mehrotra's correction for the last direction.
    pub fn aim_central(&mut self, mu: f64) {
        self.right = mu - self.s * self.z - self.ds * self.dz;
    }

    /// Targets s z = mu, to first order.
    pub fn aim_centre(&mut self, mu: f64) {
        self.right = mu - self.s * self.z;
    }

    /// Longest step along the direction that leaves both numbers positive.
    pub fn longest_step(&self) -> f64 {
        let step = |x: f64, d: f64| if d < 0.0 { -x / d } else { f64::INFINITY };
        step(self.s, self.ds).min(step(self.z, self.dz))
    }

    pub fn gap_after(&self, alpha: f64) -> f64 {
        (self.s + alpha * self.ds) * (self.z + alpha * self.dz)
    }

    pub fn advance(&mut self, alpha: f64) {
        self.s = (self.s + alpha * self.ds).max(f64::MIN_POSITIVE);
        self.z = (self.z + alpha * self.dz).max(f64::MIN_POSITIVE);
    }
}
