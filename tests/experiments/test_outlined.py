"""Kernels keep their instructions: see ``experiments.outlined``."""

from __future__ import annotations

from pathlib import Path

import pytest

from experiments import outlined
from snake_env import _native

LISTING = """
0000000000001000 <snake_core::laws::Law<T>::evaluate>:
    1004:\tcall   2000 <core::core_arch::x86::avx512f::_mm512_add_pd>
0000000000001100 <snake_core::solver::Ray<T>::derivatives::{{closure}}>:
    1104:\tcall   2000 <core::core_arch::x86::avx512f::_mm512_add_pd>
    1109:\tjmp    2000 <core::core_arch::x86::avx512f::_mm512_mul_pd>
0000000000001200 <<core::iter::adapters::map::Map<I,F> as core::iter::Iterator>::next>:
    1204:\tcall   2000 <core::core_arch::x86::avx::_mm256_add_pd>
0000000000002000 <core::core_arch::x86::avx512f::_mm512_add_pd>:
    2004:\tvaddpd (%rsi),%zmm0,%zmm0
"""


def test_closures_and_adapters_are_listed_and_named_functions_are_not() -> None:
    names = {
        "snake_core::solver::Ray<T>::derivatives::{{closure}}": 2,
        "<core::iter::adapters::map::Map<I,F> as core::iter::Iterator>::next": 1,
    }
    assert dict(outlined.outlined(LISTING)) == names


@pytest.mark.skipif(not outlined.is_possible(), reason="no objdump")
def test_no_kernel_of_the_native_module_calls_vector_instructions() -> None:
    disassembly = outlined.disassemble(Path(str(_native.__file__)))
    if not outlined.has_names(disassembly):
        pytest.skip("stripped; that of a clone in which nothing but tests was made is not")
    assert not outlined.outlined(disassembly)
