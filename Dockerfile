FROM python:3.11-slim
# An init: the first process of a container gets no signal that it has no handler for, not even the stop.
RUN apt-get update && apt-get install -y --no-install-recommends tini && rm -rf /var/lib/apt/lists/*
RUN useradd --system --create-home --home-dir /var/lib/acu-daemon --groups dialout acu
RUN install -d -o acu -g acu /var/lib/acu-daemon-rehearsal
WORKDIR /opt/acu-daemon
COPY pyproject.toml constraints.txt README.md LICENSE ./
COPY acu_daemon acu_daemon
COPY config config
RUN pip install --no-cache-dir --constraint constraints.txt .
USER acu
ENV STATE_DIRECTORY=/var/lib/acu-daemon
VOLUME ["/etc/acu-daemon"]
# Healthy: the daemon in this container has ticked within the last seconds.
HEALTHCHECK --interval=30s --timeout=10s CMD ["acu-daemon", "check", "--config", "/etc/acu-daemon", "--running"]
ENTRYPOINT ["tini", "--", "acu-daemon"]
CMD ["--help"]
