//! Fields of any values: the mesh is closed, and as its nodes say.

use bevy_clay::surface::check::MeshCheck;
use bevy_clay::surface::extract::extract_field;
use bevy_clay::surface::field::Field;
use bevy_clay::surface::stitch::separate;
use clay_acceptance::cases::surface::random_fields;
use clay_acceptance::lab::Size;
use proptest::prelude::*;

/// Half of the fields are of whole numbers with many exact zeros: closed, manifold, oriented, no degenerate
/// triangle, Euler number as the nodes say.
#[test]
fn random_fields_match_the_oracle() {
    for row in random_fields(Size::Quick) {
        assert!(row.ok, "{}: {}", row.case, row.value);
    }
}

/// One node: f, and of each sheet how much of it is in front (> 0) or behind, from -1 to 1.
type Node<const N: usize> = (f32, [f32; N]);

/// The mesh of 5^3 nodes between empty ones: closed as it comes, a manifold after separation.
fn assert_sound<const N: usize>(nodes: &[Node<N>]) -> Result<(), TestCaseError> {
    let mut total = vec![0.0; 343];
    let mut sides = vec![[vec![0.0; 343], vec![0.0; 343]]; N];
    for (i, (f, parts)) in nodes.iter().enumerate() {
        let at = i % 5 + 1 + 7 * (i / 5 % 5 + 1 + 7 * (i / 25 + 1));
        total[at] = *f;
        for (side, part) in sides.iter_mut().zip(parts) {
            side[usize::from(*part < 0.0)][at] = part.abs().min(*f);
        }
    }
    let sides = sides.iter().map(|[p, m]| (&p[..], &m[..]));
    let mesh = extract_field(&Field::from_nodes([7; 3], &total, sides), 0.5);
    let check = MeshCheck::of(&mesh);
    prop_assert!(check.open_edges == 0 && check.misoriented_edges == 0, "{check:?}");
    let check = MeshCheck::of(&separate(&mesh));
    prop_assert!(check.is_closed_manifold(), "{check:?}");
    Ok(())
}

/// Nodes of which a third is beyond each sheet's reach, in front of it, behind it.
fn nodes<const N: usize>() -> impl Strategy<Value = Vec<Node<N>>> {
    let part = (0.0f32..1.2, -1i8..2).prop_map(|(part, side)| part * f32::from(side));
    proptest::collection::vec((0.0f32..1.2, proptest::array::uniform(part)), 125)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    /// Any f, P and M, consistent or not.
    #[test]
    fn any_fields_of_one_sheet_give_a_closed_surface(nodes in nodes::<1>()) {
        assert_sound(&nodes)?;
    }

    #[test]
    fn any_fields_of_two_sheets_give_a_closed_surface(nodes in nodes::<2>()) {
        assert_sound(&nodes)?;
    }

    /// More sheets than a node or cell can have.
    #[test]
    fn any_fields_of_six_sheets_give_a_closed_surface(nodes in nodes::<6>()) {
        assert_sound(&nodes)?;
    }
}
