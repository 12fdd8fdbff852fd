"""What goes out to programs that are there already: metrics for Prometheus, a rotctld port, MQTT."""
