use super::pair::Pair;

/// Opening and impulse of one contact, and the impulse around which the contact is soft.
#[derive(Debug, Clone, Copy)]
pub(super) struct Contact {
    pub pair: Pair,
    centre: f64,
    /// Compliance of the contact around the centre \[1/kg\].
    softness: f64,
}

impl Contact {
    /// Of a link of mass `mass` \[kg\].
    pub fn new(mass: f64) -> Self {
        Self { pair: Pair::default(), centre: 0.0, softness: 1.0 / (STIFFEST * mass) }
    }

    /// A pair whose product is `mu`, of a contact that opens at the velocity `opening` on a link of mass `mass`.
    pub fn begin(&mut self, opening: f64, mass: f64, mu: f64) {
        let s = opening.max((2.0 * mu / mass).sqrt());
        self.pair = Pair::new(s, mu / s);
    }

    /// Velocity by which the contact violates its law, because it is soft \[m/s\].
    pub fn violation(&self) -> f64 {
        self.softness * (self.pair.z - self.centre)
    }

    /// The present impulse becomes the centre.
    pub fn recentre(&mut self) {
        self.centre = self.pair.z;
    }

    /// Impulse and stiffness of the contact, linearised at the velocity `opening`.
    pub fn linearised(&self, opening: f64) -> (f64, f64) {
        let pair = &self.pair;
        let resistance = pair.s + pair.z * self.softness;
        (pair.z + (pair.right - pair.z * self.mismatch(opening)) / resistance, pair.z / resistance)
    }

    /// Updates the pair to the velocity `opening` and its change.
    pub fn follow(&mut self, opening: f64, change: f64) {
        let closing = self.mismatch(opening) + change;
        let Self { pair, softness, .. } = self;
        pair.dz = (pair.right - pair.z * closing) / (pair.s + pair.z * *softness);
        pair.ds = closing + *softness * pair.dz;
    }

    /// The impulse on a link of mass `mass` \[N s\]; an open contact's is only nearly zero on the central path.
    pub fn impulse(&self, mass: f64) -> f64 {
        let Pair { s, z, .. } = self.pair;
        if z < mass * s { 0.0 } else { z }
    }

    /// What the opening exceeds the pair's by.
    fn mismatch(&self, opening: f64) -> f64 {
        opening + self.violation() - self.pair.s
    }
}

/// Largest stiffness, in link masses: it makes the impulses of jammed stages finite.
const STIFFEST: f64 = 1e12;
