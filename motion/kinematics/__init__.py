"""Forward kinematics, Jacobians and the models behind them."""
