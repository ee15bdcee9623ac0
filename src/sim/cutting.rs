//! How tools act on clay: the crate's own method, and those of others, to compare.

use super::variants::variants;
use serde::{Deserialize, Serialize};

/// The method by which blades part the clay. All but the first stand here for comparison, on the native
/// engine and the oracle only, and know no wires.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum CuttingMethod {
    /// Sides taken by the swept blade and kept when it leaves; a velocity for each side at a node, and
    /// contact between them.
    #[default]
    TwoFields,
    /// Eq. 1-3 to the letter: the side of a node and of a particle is the sign of its present distance from
    /// the blade, of nodes and particles alike, and nothing is kept. A particle gives mass and momentum to
    /// compatible nodes only; at the others it has a ghost velocity, its own, projected on the blade by the
    /// contact of the tool (Hu et al. 2018, ACM TOG 37:150). The penalty force that the text names has no
    /// formula and is left out.
    Published,
    /// CPIC as Hu et al. 2018 have it: the blade is sampled by rigid particles, a node has side and distance
    /// of the nearest of them, and a particle takes the side that most of its nodes have
    /// (`sign(sum w T |d|)`), which it keeps while it is near. Ghost velocities as under [`Self::Published`].
    RigidParticles,
    /// The interactive particles of Deng et al., the paper's comparison \[7\]: every tool, blade or solid, is
    /// sampled by particles of the clay's density, whose way is given. They take part in the transfer to the
    /// nodes as clay without stress, so that clay sticks to them: `v = (p + P_tool) / (m + M_tool)`.
    InteractiveParticles,
}

variants! {
    /// Every method.
    CuttingMethod: TwoFields, Published, RigidParticles, InteractiveParticles
}

impl CuttingMethod {
    /// Whether cuts stay when the blade leaves: the crate's own method.
    pub fn keeps_cuts(self) -> bool {
        match self {
            Self::TwoFields => true,
            Self::Published | Self::RigidParticles | Self::InteractiveParticles => false,
        }
    }

    /// Whether particles have ghost velocities at nodes beyond a blade.
    pub fn has_ghosts(self) -> bool {
        match self {
            Self::Published | Self::RigidParticles => true,
            Self::TwoFields | Self::InteractiveParticles => false,
        }
    }
}
