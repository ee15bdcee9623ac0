//! Fields of any values: the mesh is closed, and as its nodes say.

use bevy_clay::surface::check::MeshCheck;
use bevy_clay::surface::extract::extract_field;
use bevy_clay::surface::field::Field;
use bevy_clay::surface::oracle::euler_number_of_nodes;
use bevy_clay::surface::stitch::separate;
use clay_acceptance::cases::surface::clay::Random;
use proptest::prelude::*;

/// 1,000 random fields of 7^3 nodes, half of them of whole numbers with many exact zeros: closed, manifold,
/// oriented, no degenerate triangle, Euler number as the nodes say.
#[test]
fn random_fields_match_the_oracle() {
    let mut random = Random(1);
    let extent = [9; 3];
    for case in 0..1000 {
        let mut values = vec![-1.0f32; 729];
        for i in 0..343 {
            let value = random.range(-1.0, 1.0);
            let at = i % 7 + 1 + 9 * (i / 7 % 7 + 1 + 9 * (i / 49 + 1));
            values[at] = if case % 2 == 0 { value as f32 } else { (value * 3.5).round() as f32 };
        }
        let mesh = extract_field(&Field::from_nodes(extent, &values, None), 0.0);
        let check = MeshCheck::of(&mesh);
        assert!(check.is_closed_manifold() && check.degenerate_triangles == 0, "case {case}: {check:?}");
        assert_eq!(check.euler, euler_number_of_nodes(extent, &values, 0.0), "case {case}");
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
