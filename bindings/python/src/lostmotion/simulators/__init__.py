"""The drive in other simulators: FMUs and MuJoCo.

These modules are imported only on use. They need no further package, except
`lostmotion.simulators.mujoco`, which needs MuJoCo (``pip install lostmotion[mujoco]``).
"""
