//! Raw bindings to the installed PETSc, and to METIS's nested dissection: the functions that mpm-petsc calls.
//!
//! Everything here is generated from the installed headers (see `build.rs`), except one function:
//! [`PetscSysRegisterMetisPartitioning`] adds a `MatPartitioning` type `metis`, which PETSc itself does not have.
//! Enumerations are plain constants. Callers write [`PetscInt`] and never assume its width.
#![allow(non_camel_case_types, non_snake_case, non_upper_case_globals, clippy::all)]

include!(concat!(env!("OUT_DIR"), "/bindings.rs"));

const _: () = assert!(
    size_of::<PetscScalar>() == size_of::<f64>(),
    "PETSc must be built for double precision"
);
const _: () = assert!(
    size_of::<PetscInt>() == 4 || size_of::<PetscInt>() == 8,
    "unknown width of PetscInt"
);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scalars_are_real_doubles() {
        let value: PetscScalar = 0.5_f64;
        assert_eq!(value + value, 1.0);
    }

    #[test]
    fn the_version_is_one_that_the_wrapper_was_written_for() {
        assert!((PETSC_VERSION_MAJOR, PETSC_VERSION_MINOR) >= (3, 18));
    }

    #[test]
    fn metis_gives_a_permutation_and_its_inverse() {
        // A path of four vertices.
        let (mut n, mut start, mut neighbours) = (4, [0, 1, 3, 5, 6], [1, 0, 2, 1, 3, 2]);
        let (mut permutation, mut inverse) = ([0; 4], [0; 4]);
        let mut options = [0; METIS_NOPTIONS as usize];
        // SAFETY: the arrays have the lengths that METIS documents for four vertices and six directed edges.
        let status = unsafe {
            METIS_SetDefaultOptions(options.as_mut_ptr());
            METIS_NodeND(
                &mut n,
                start.as_mut_ptr(),
                neighbours.as_mut_ptr(),
                std::ptr::null_mut(),
                options.as_mut_ptr(),
                permutation.as_mut_ptr(),
                inverse.as_mut_ptr(),
            )
        };
        assert_eq!(status, METIS_OK);
        for (i, &p) in permutation.iter().enumerate() {
            assert_eq!(inverse[p as usize], i as idx_t);
        }
    }
}
