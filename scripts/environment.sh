# shellcheck shell=bash
# Environment of runs with MPI, to be sourced by the other scripts; what is set already stays.

if [ "$(id -u)" -eq 0 ]; then
    # Open MPI refuses to start as root, which is the only user of many containers.
    export OMPI_ALLOW_RUN_AS_ROOT="${OMPI_ALLOW_RUN_AS_ROOT:-1}"
    export OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="${OMPI_ALLOW_RUN_AS_ROOT_CONFIRM:-1}"
fi
# More ranks than cores are allowed, and then give up the processor while they wait.
export OMPI_MCA_rmaps_base_oversubscribe="${OMPI_MCA_rmaps_base_oversubscribe:-1}"
# Containers forbid the system call behind single copies between processes; Open MPI warns of it at every start.
export OMPI_MCA_btl_vader_single_copy_mechanism="${OMPI_MCA_btl_vader_single_copy_mechanism:-none}"
# No warning where InfiniBand hardware is absent or driven by another component.
export OMPI_MCA_btl_openib_warn_no_device_params_found="${OMPI_MCA_btl_openib_warn_no_device_params_found:-0}"
export OMPI_MCA_btl_base_warn_component_unused="${OMPI_MCA_btl_base_warn_component_unused:-0}"
# A rank that ends with an exit code has said why; mpirun would add ten lines that say no more.
export OMPI_MCA_orte_execute_quiet="${OMPI_MCA_orte_execute_quiet:-1}"
# The ranks are the parallelism; threads of the linear algebra would compete with them.
export OPENBLAS_NUM_THREADS="${OPENBLAS_NUM_THREADS:-1}"
export OMP_NUM_THREADS="${OMP_NUM_THREADS:-1}"
# Where rustup puts cargo; a shell that is no login shell may not know.
if ! command -v cargo >/dev/null && [ -x "$HOME/.cargo/bin/cargo" ]; then
    export PATH="$HOME/.cargo/bin:$PATH"
fi
