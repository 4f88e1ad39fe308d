"""The drive in other people's simulators: FMUs, and MuJoCo.

Nothing here is imported by the rest of the package before it is requested, and nothing needs
another package than the plain installation, but for `lostmotion.simulators.mujoco`, which needs
MuJoCo (``pip install lostmotion[mujoco]``).
"""
