# The commands of tickrig, for a user who is not root; docs/howto/without-installation.md
#   docker build -t tickrig .
#   docker run --rm tickrig demo fig120
# The target `dev` is the environment of .devcontainer/.
ARG BASE=python:3.11-slim-bookworm

# hadolint ignore=DL3006 # BASE has a tag
FROM ${BASE} AS dev
# hadolint ignore=DL3008 # what the base has with its security updates
RUN apt-get update \
    && apt-get install -y --no-install-recommends \
        can-utils gcc git iproute2 kmod libc6-dev make mount user-mode-linux \
    && rm -rf /var/lib/apt/lists/* \
    && useradd --create-home --uid 1000 tickrig
USER 1000

# hadolint ignore=DL3006 # BASE has a tag
FROM ${BASE} AS build
ARG EXTRAS=tui,fast,report,rtc,bus,test
# For a build without a network: PIP_NO_INDEX=1, and a folder of wheels for PIP_FIND_LINKS
ARG PIP_NO_INDEX
ARG PIP_FIND_LINKS
ENV PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_CACHE_DIR=1
WORKDIR /src
COPY . .
RUN python3 -m venv /opt/tickrig \
    && /opt/tickrig/bin/pip install --quiet ".[${EXTRAS}]"

# hadolint ignore=DL3006 # BASE has a tag
FROM ${BASE}
RUN useradd --create-home --uid 1000 tickrig \
    && install --directory --owner tickrig /work
COPY --from=build /opt/tickrig /opt/tickrig
ENV PATH=/opt/tickrig/bin:$PATH PYTHONUNBUFFERED=1
WORKDIR /work
USER 1000
ENTRYPOINT ["tickrig"]
CMD ["demo"]
