"""Trajectories: samples, point-to-point motion, joint curves, time scaling, the certificate."""
