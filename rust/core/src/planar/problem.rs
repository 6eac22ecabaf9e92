//! A stage problem as a file, so that a hard stage can be solved again elsewhere.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use crate::error::{ConfigError, finite, non_negative, positive, require};
use crate::rows::InLane;

use super::{
    Heading, Stage, StageContact, StageContactFriction, StageJoint, StageLink, StagePair, StageSolution, Twist,
};

/// A stage with a name. JSON has no infinity: a drive without limit has none in the file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Problem {
    /// Where the stage comes from.
    pub name: String,
    /// c \[s\].
    pub coefficient: f64,
    pub links: Vec<LinkRow>,
    pub joints: Vec<JointRow>,
    pub contacts: Vec<ContactRow>,
    /// Not written where no links touch.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pairs: Vec<PairRow>,
}

/// [`StageLink`] as a row.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LinkRow {
    /// Cosine and sine of the absolute angle.
    pub heading: [f64; 2],
    pub reference: Twist,
    pub mass: f64,
    pub inertia: f64,
    pub half_length: f64,
    pub friction: Vector2<f64>,
}

/// [`StageJoint`] as a row.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointRow {
    pub drive: f64,
    pub stiffness: f64,
    pub limit: Option<f64>,
    /// Not written where there is no play.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub slack: f64,
}

/// [`StageContact`] as a row.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ContactRow {
    pub link: usize,
    pub direction: Twist,
    pub offset: f64,
    /// Not written where the contact has no friction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction: Option<FrictionRow>,
}

/// Friction of a contact, [`StageContactFriction`] without its bound.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrictionRow {
    pub direction: Twist,
    pub coefficient: f64,
}

/// [`StagePair`] as a row.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PairRow {
    pub links: [usize; 2],
    pub direction: [Twist; 2],
    pub offset: f64,
}

/// A velocity and the impulses that certify it, as a file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Answer {
    pub twist: Vec<Twist>,
    pub friction: Vec<Vector2<f64>>,
    pub drive: Vec<f64>,
    pub contact: Vec<f64>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub contact_friction: Vec<f64>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pair: Vec<f64>,
}

impl Problem {
    /// `stage` under a name; contacts without a direction, which fill the lanes of others, are left out.
    pub fn new(name: impl Into<String>, stage: &Stage) -> Self {
        let link = |link: &StageLink| LinkRow {
            heading: [link.heading.cos, link.heading.sin],
            reference: link.reference,
            mass: link.mass,
            inertia: link.inertia,
            half_length: link.half_length,
            friction: link.friction,
        };
        let joint = |joint: &StageJoint| JointRow {
            drive: joint.drive,
            stiffness: joint.stiffness,
            limit: joint.limit.is_finite().then_some(joint.limit),
            slack: joint.slack,
        };
        let friction = |k: usize| {
            let row = stage.contact_friction.iter().find(|row| row.contact == k);
            row.map(|row| FrictionRow { direction: row.direction, coefficient: row.coefficient })
        };
        let contact = |(k, c): (usize, &StageContact)| ContactRow {
            link: c.link,
            direction: c.direction,
            offset: c.offset,
            friction: friction(k),
        };
        let pair = |p: &StagePair| PairRow { links: p.links, direction: p.direction, offset: p.offset };
        let real_pairs = stage.pairs.iter().filter(|pair| pair.is_in(0));
        let real = stage.contacts.iter().enumerate().filter(|(_, contact)| contact.is_in(0));
        Self {
            name: name.into(),
            coefficient: stage.coefficient,
            links: stage.links.iter().map(link).collect(),
            joints: stage.joints.iter().map(joint).collect(),
            contacts: real.map(contact).collect(),
            pairs: real_pairs.map(pair).collect(),
        }
    }

    /// The stage, exactly as it was written.
    ///
    /// # Errors
    /// Names the row that cannot be part of a stage.
    pub fn stage(&self) -> Result<Stage, ConfigError> {
        self.validate()?;
        Ok(Stage {
            coefficient: self.coefficient,
            links: self.links.iter().map(StageLink::from).collect(),
            joints: self.joints.iter().map(StageJoint::from).collect(),
            stops: Vec::new(),
            contacts: self.contacts.iter().map(StageContact::from).collect(),
            contact_friction: self.contact_friction(),
            pairs: self.pairs.iter().map(StagePair::from).collect(),
        })
    }

    fn contact_friction(&self) -> Vec<StageContactFriction> {
        let rows = self.contacts.iter().enumerate().filter_map(|(contact, row)| {
            let FrictionRow { direction, coefficient } = *row.friction.as_ref()?;
            Some(StageContactFriction { contact, link: row.link, direction, coefficient, bound: 0.0 })
        });
        rows.collect()
    }

    fn validate(&self) -> Result<(), ConfigError> {
        let (n, joints) = (self.links.len(), self.joints.len());
        require(n >= 2, "links", n, "2 links or more")?;
        require(joints == n - 1, "joints", joints, "one joint fewer than links")?;
        positive("coefficient", self.coefficient)?;
        for (i, link) in self.links.iter().enumerate() {
            let field = |name: &str| format!("links[{i}].{name}");
            positive(&field("mass"), link.mass)?;
            positive(&field("inertia"), link.inertia)?;
            positive(&field("half_length"), link.half_length)?;
            link.friction.iter().try_for_each(|&a| non_negative(&field("friction"), a).map(drop))?;
            link.reference.iter().try_for_each(|&u| finite(&field("reference"), u).map(drop))?;
            let [cos, sin] = link.heading;
            require((cos.hypot(sin) - 1.0).abs() < 1e-9, &field("heading"), cos.hypot(sin), "a vector of length 1")?;
        }
        for (j, joint) in self.joints.iter().enumerate() {
            let field = |name: &str| format!("joints[{j}].{name}");
            finite(&field("drive"), joint.drive)?;
            non_negative(&field("stiffness"), joint.stiffness)?;
            joint.limit.map_or(Ok(0.0), |limit| positive(&field("limit"), limit))?;
            non_negative(&field("slack"), joint.slack)?;
        }
        for (k, contact) in self.contacts.iter().enumerate() {
            let field = |name: &str| format!("contacts[{k}].{name}");
            require(contact.link < n, &field("link"), contact.link, &format!("an integer in [0, {}]", n - 1))?;
            let first = k.checked_sub(1).map_or(0, |before| self.contacts[before].link);
            require(contact.link >= first, &field("link"), contact.link, "contacts sorted by link")?;
            finite(&field("offset"), contact.offset)?;
            contact.direction.iter().try_for_each(|&w| finite(&field("direction"), w).map(drop))?;
            if let Some(friction) = &contact.friction {
                non_negative(&field("friction.coefficient"), friction.coefficient)?;
                friction.direction.iter().try_for_each(|&w| finite(&field("friction.direction"), w).map(drop))?;
            }
        }
        for (k, pair) in self.pairs.iter().enumerate() {
            let field = |name: &str| format!("pairs[{k}].{name}");
            let [i, j] = pair.links;
            require(i < j && j < n, &field("links"), format!("{i}, {j}"), "two different links, in order")?;
            finite(&field("offset"), pair.offset)?;
            pair.direction.iter().flatten().try_for_each(|&w| finite(&field("direction"), w).map(drop))?;
        }
        Ok(())
    }
}

fn is_zero(slack: &f64) -> bool {
    *slack == 0.0
}

impl From<&LinkRow> for StageLink {
    fn from(row: &LinkRow) -> Self {
        Self {
            heading: Heading { cos: row.heading[0], sin: row.heading[1] },
            reference: row.reference,
            mass: row.mass,
            inertia: row.inertia,
            half_length: row.half_length,
            friction: row.friction,
        }
    }
}

impl From<&JointRow> for StageJoint {
    fn from(row: &JointRow) -> Self {
        let limit = row.limit.unwrap_or(f64::INFINITY);
        Self { drive: row.drive, stiffness: row.stiffness, limit, slack: row.slack }
    }
}

impl From<&ContactRow> for StageContact {
    fn from(row: &ContactRow) -> Self {
        Self { link: row.link, direction: row.direction, offset: row.offset }
    }
}

impl From<&PairRow> for StagePair {
    fn from(row: &PairRow) -> Self {
        Self { links: row.links, direction: row.direction, offset: row.offset }
    }
}

impl From<&StageSolution> for Answer {
    fn from(solution: &StageSolution) -> Self {
        let StageSolution { twist, friction, actuator: drive, contact, contact_friction, pair, .. } = solution.clone();
        Self { twist, friction, drive, contact, contact_friction, pair }
    }
}

impl From<Answer> for StageSolution {
    fn from(answer: Answer) -> Self {
        let Answer { twist, friction, drive, contact, contact_friction, pair } = answer;
        Self { twist, friction, actuator: drive, stop: Vec::new(), contact, contact_friction, pair }
    }
}
