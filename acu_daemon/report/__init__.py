"""What people look at afterwards: pass report and plots."""
