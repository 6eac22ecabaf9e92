//! How deep the end of a step takes links into pegs and into each other; see [`crate::stepping::penetration`].
//!
//! A link that moves farther than its radius in one step near a contact could pass to the other side of it, so such a
//! step is divided, too.

use crate::math::Real;
use crate::obstacles::Peg;
use crate::pegs::PegGrid;
use crate::robot::Link;
use crate::stepping::lanes::active;
use crate::stepping::penetration::{ALLOWED, Sinking};
use crate::stepping::{Driven, Members};

use super::workspace::Workspace;
use super::{Frame, Laned, Spatial, nearest_point};

impl<T: Real> Workspace<T> {
    /// Examines the ends of the members' steps.
    pub(super) fn measure_sinking<D: Driven<Model = Spatial>>(&mut self, members: &Members<D>) {
        let links = &members.system.robot.links;
        for lane in active(members.lanes()) {
            let pegs = &members.body(lane).pegs;
            let mut sinking = Sinking::No;
            if !pegs.pegs().is_empty() {
                for (i, link) in links.iter().enumerate() {
                    let [start, end] = [&self.start_frames[i], &self.frames[i]].map(|frame| frame.lane(lane));
                    sinking = sinking.max(sinking_into_pegs(link, &start, &end, pegs));
                }
            }
            if self.self_contacts.is_near(lane) {
                sinking = sinking.max(self.self_contacts.sinking(links, &self.start_frames, &self.frames, lane));
            }
            self.sinking[lane] = sinking;
        }
    }
}

fn sinking_into_pegs(link: &Link, start: &Frame, end: &Frame, pegs: &PegGrid) -> Sinking {
    let mut sinking = Sinking::No;
    let travelled = (end.position - start.position).norm();
    let (near, may_cross) = (&end.position, travelled > link.radius);
    pegs.visit_near(near.x, near.y, link.reach() + if may_cross { travelled } else { 0.0 }, |peg| {
        let peg = &pegs.pegs()[peg];
        let gap_at_end = gap(link, end, peg);
        if may_cross {
            sinking = sinking.max(Sinking::TooDeep);
        }
        if gap_at_end < -ALLOWED {
            sinking = sinking.max(Sinking::of(gap(link, start, peg), gap_at_end));
        }
    });
    sinking
}

fn gap(link: &Link, frame: &Frame, peg: &Peg) -> f64 {
    nearest_point(link, &frame.position, &frame.axes[2], peg).0.norm() - (peg.radius + link.radius)
}
